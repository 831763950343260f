#include "clients/doors/door.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/experiment/layout.hpp"

namespace kilotwin::doors {
namespace {

const char* word_of(proto::Door::KindCase kind) {
  switch (kind) {
    case proto::Door::kRos2: return "ros2";
    case proto::Door::kArk: return "ark";
    case proto::Door::kListener: return "listener";
    default: return "log";
  }
}

int find_door(const LoadedExperiment& loaded, proto::Door::KindCase kind, const std::string& name) {
  const proto::Experiment& experiment = loaded.experiment;
  std::vector<int> found;
  std::string names;
  for (int i = 0; i < experiment.door_size(); ++i) {
    if (experiment.door(i).kind_case() != kind) continue;
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", one_line(experiment.door(i).name(), 64));
    if (name.empty() || experiment.door(i).name() == name) found.push_back(i);
  }
  if (found.size() == 1) return found.front();
  if (names.empty()) {
    throw loaded.locations.error("door",
                                 fmt::format("the experiment has no door to {0}; add door {{ name: \"NAME\" {0} "
                                             "{{ ... }} }}",
                                             word_of(kind)));
  }
  if (found.empty()) {
    throw UserError(
        fmt::format("--door: \"{}\" is no door of this experiment; give one of {}", one_line(name, 64), names));
  }
  throw UserError(fmt::format("--door is missing: the experiment has the doors {}; name one of them", names));
}

std::vector<bool> tracked_robots(const LoadedExperiment& loaded) {
  const PlacedRobots placed = place_robots(loaded);
  std::vector<bool> tracked;
  for (std::size_t g = 0; g < placed.group_count.size(); ++g) {
    const bool body = loaded.experiment.robots(static_cast<int>(g)).body() == proto::RobotGroup::TRACKED;
    tracked.insert(tracked.end(), placed.group_count[g], body);
  }
  return tracked;
}

/// Names of the door that mean a robot which is not tracked are mistakes of the file.
void check_listed(const LoadedExperiment& loaded, int index, const std::vector<bool>& tracked) {
  const auto refuse = [&](const std::string& field, std::uint32_t robot) {
    if (robot < tracked.size() && tracked[robot]) return;
    throw loaded.locations.error(
        fmt::format("door[{}].robots.{}", index, field),
        fmt::format("robot {} is not tracked; name a robot of a group with body: TRACKED", robot));
  };
  const proto::Door& door = loaded.experiment.door(index);
  const auto number = door.listener().robot();
  if (door.listener().has_robot() && (number >= tracked.size() || !tracked[number])) {
    throw loaded.locations.error(
        fmt::format("door[{}].listener.robot", index),
        fmt::format("robot {} is not tracked; name the listener, a robot of a group with body: TRACKED", number));
  }
  const proto::DoorRobots& robots = door.robots();
  if (robots.has_first_robot()) refuse("first_robot", robots.first_robot());
  for (int i = 0; i < robots.robot_size(); ++i) refuse(fmt::format("robot[{}].robot", i), robots.robot(i).robot());
}

bool reads_poses(const proto::Door& door) { return !door.has_ros2() || door.ros2().topic_size() > 0; }

}  // namespace

Door open_door(const LoadedExperiment& loaded, proto::Door::KindCase kind, const std::string& name) {
  std::vector<bool> tracked = tracked_robots(loaded);
  const int index = find_door(loaded, kind, name);
  const proto::Door& settings = loaded.experiment.door(index);
  if (reads_poses(settings) && std::find(tracked.begin(), tracked.end(), true) == tracked.end()) {
    throw loaded.locations.error(
        fmt::format("door[{}]", index),
        fmt::format("the door {}, but no robot is tracked; add a group with body: TRACKED",
                    settings.has_listener() ? "tells what real robots say" : "reads poses"));
  }
  check_listed(loaded, index, tracked);
  return {settings, Placement(settings), RobotNames(settings.robots(), std::move(tracked))};
}

}  // namespace kilotwin::doors
