// Doors: what the table of ranges cannot say.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "core/base/say.hpp"
#include "core/experiment/field_checks.hpp"
#include "core/experiment/line_pattern.hpp"

namespace kilotwin {
namespace {

constexpr int kMostDoors = 16, kMostTopics = 64;
/// As in idl/public.idl.
constexpr std::size_t kLongestSource = 63;
constexpr std::string_view kNumber = "{number}", kName = "{name}";

using proto::Door;

class DoorCheck {
 public:
  DoorCheck(const LoadedExperiment& loaded, int index)
      : loaded_(loaded), door_(loaded.experiment.door(index)), path_(fmt::format("door[{}]", index)) {}

  void check() const {
    check_name();
    if (door_.kind_case() == Door::KIND_NOT_SET)
      fail("", "door has no kind; it takes ros2, ark, log or listener { ... }");
    check_robots();
    if (door_.has_ros2()) check_ros2();
    if (door_.has_log()) check_log();
    if (door_.has_listener()) check_listener();
    check_source();
  }

 private:
  [[noreturn]] void fail(const std::string& field, const std::string& text) const {
    throw loaded_.locations.error(path_ + field, text);
  }
  void check_name() const;
  void check_robots() const;
  void check_ros2() const;
  void check_log() const;
  void check_listener() const;
  void check_source() const;
  void check_topic_name(const std::string& field, std::string name, bool takes_name) const;

  const LoadedExperiment& loaded_;
  const Door& door_;
  std::string path_;
};

void DoorCheck::check_name() const {
  if (!door_.has_name()) fail("", "name is missing; state name: \"NAME\", the source that tracker frames name");
  if (door_.name().size() <= kLongestSource) return;
  fail(".name", fmt::format("name has {} characters; it takes at most {}", door_.name().size(), kLongestSource));
}

void DoorCheck::check_robots() const {
  const proto::DoorRobots& robots = door_.robots();
  const std::string& pattern = robots.pattern();
  const std::size_t at = pattern.find(kNumber);
  if (at == std::string::npos || pattern.find(kNumber, at + 1) != std::string::npos) {
    fail(".robots.pattern", fmt::format("pattern is \"{}\"; it takes a name with {} once, where the number stands",
                                        one_line(pattern, 60), kNumber));
  }
  std::map<std::string, int> entry_of;
  std::map<std::uint32_t, int> name_of;
  for (int i = 0; i < robots.robot_size(); ++i) {
    const std::string field = fmt::format(".robots.robot[{}]", i);
    const proto::NamedRobot& robot = robots.robot(i);
    if (!robot.has_name() || !robot.has_robot())
      fail(field, "name or robot is missing; state both, name: \"NAME\" robot: ID");
    const auto refuse_second = [&](int earlier, const std::string& what) {
      fail(field, fmt::format("{} has an entry already, at {}; keep one of them", what,
                              loaded_.locations.where(fmt::format("{}.robots.robot[{}]", path_, earlier))));
    };
    if (const auto [found, first] = entry_of.emplace(robot.name(), i); !first)
      refuse_second(found->second, fmt::format("\"{}\"", one_line(robot.name(), 60)));
    if (const auto [found, first] = name_of.emplace(robot.robot(), i); !first)
      refuse_second(found->second, fmt::format("robot {}", robot.robot()));
  }
}

void DoorCheck::check_topic_name(const std::string& field, std::string name, bool takes_name) const {
  const std::size_t at = name.find(kName);
  // A letter stands for the name, so that the rest is checked as it will be.
  if (takes_name && at != std::string::npos) name.erase(at, kName.size()).insert(at, 1, 'n');
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  bool good = name.size() > 1 && name.front() == '/' && name.back() != '/';
  for (std::size_t i = 1; i < name.size() && good; ++i) {
    const bool begins = name[i - 1] == '/';
    good = letter(name[i]) || (!begins && ((name[i] >= '0' && name[i] <= '9') || name[i] == '/'));
  }
  if (good) return;
  fail(field, fmt::format("the topic is \"{}\"; it takes an absolute name of ROS such as \"/poses\": letters, "
                          "digits, '_', and '/' before each part{}",
                          one_line(name, 80), takes_name ? fmt::format("; {} may stand once", kName) : ""));
}

void DoorCheck::check_ros2() const {
  const proto::Ros2Door& ros2 = door_.ros2();
  if (ros2.topic_size() > kMostTopics) {
    fail(".ros2.topic",
         fmt::format("there are {} topics; a door takes at most {}", ros2.topic_size(), kMostTopics));
  }
  std::map<std::string, int> entry_of;
  for (int i = 0; i < ros2.topic_size(); ++i) {
    const std::string field = fmt::format(".ros2.topic[{}]", i);
    const proto::Ros2Topic& topic = ros2.topic(i);
    if (!topic.has_name()) fail(field, "name is missing; state name: \"/TOPIC\"");
    if (!topic.has_type()) {
      fail(field, "type is missing; state the type of its messages, for example type: NAMED_POSE_ARRAY");
    }
    const bool single = topic.type() == proto::Ros2Topic::POSE_STAMPED ||
                        topic.type() == proto::Ros2Topic::POSE_WITH_COVARIANCE_STAMPED;
    check_topic_name(field + ".name", topic.name(), single);
    if (single && topic.name().find(kName) == std::string::npos) {
      fail(field + ".name", fmt::format("messages of \"{}\" do not say whose pose they bring; write {} where the "
                                        "robot's name stands in the topic",
                                        one_line(topic.name(), 80), kName));
    }
    if (const auto [found, first] = entry_of.emplace(topic.name(), i); !first) {
      fail(field + ".name",
           fmt::format("the topic is read already, at {}; keep one of them",
                       loaded_.locations.where(fmt::format("{}.ros2.topic[{}]", path_, found->second))));
    }
  }
  if (ros2.publish().has_poses()) check_topic_name(".ros2.publish.poses", ros2.publish().poses(), false);
  const bool publishes = ros2.publish().has_poses() || ros2.publish().clock();
  if (ros2.topic_size() == 0 && !publishes)
    fail(".ros2", "ros2 neither reads nor publishes; add topic { ... } or publish { ... }");
}

void DoorCheck::check_log() const {
  const proto::LogDoor& log = door_.log();
  const bool lars = log.format() == proto::LogDoor::LARS;
  if (lars && !door_.placement().has_unit_mm()) {
    fail("",
         "placement.unit_mm is missing; a log of LARS is in pixels of its camera: state unit_mm, millimetres "
         "per pixel");
  }
  const std::uint32_t columns = log.columns();
  const bool fits = lars ? columns == 3 || columns == 4 || columns == 6 : columns == 5 || columns == 6;
  if (log.has_columns() && !fits) {
    fail(".log.columns", fmt::format("columns is {}; a log of {} takes {}", columns, lars ? "LARS" : "ARK",
                                     lars ? "3, 4 or 6" : "5 or 6"));
  }
}

void DoorCheck::check_listener() const {
  const proto::ListenerDoor& listener = door_.listener();
  const std::string wrong = defect_of_line_pattern(listener.line());
  if (!wrong.empty()) fail(".listener.line", wrong);
  const bool tells_sender = listener.has_id_octet() || listener.line().find("{sender}") != std::string::npos;
  if (!tells_sender && !listener.has_robot()) {
    fail(".listener",
         "nothing tells who sent a message; state robot: NUMBER, the listener's own, or id_octet, or {sender} in "
         "line");
  }
}

/// Where the experiment lists trackers, samples of others do not count.
void DoorCheck::check_source() const {
  const auto& trackers = loaded_.experiment.tracker();
  const bool reads_poses = !door_.has_listener() && (!door_.has_ros2() || door_.ros2().topic_size() > 0);
  if (trackers.empty() || !reads_poses) return;
  const auto is_this = [this](const proto::Tracker& tracker) { return tracker.source() == door_.name(); };
  if (std::any_of(trackers.begin(), trackers.end(), is_this)) return;
  fail(".name",
       fmt::format("the experiment lists its trackers, and \"{0}\" is none of them, so its poses would not "
                   "count; add tracker {{ source: \"{0}\" }}",
                   one_line(door_.name(), 64)));
}

}  // namespace

void check_doors(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  if (experiment.door_size() > kMostDoors) {
    throw loaded.locations.error("door", fmt::format("there are {} doors; an experiment takes at most {}",
                                                     experiment.door_size(), kMostDoors));
  }
  std::map<std::string, int> entry_of;
  for (int i = 0; i < experiment.door_size(); ++i) {
    DoorCheck(loaded, i).check();
    if (const auto [found, first] = entry_of.emplace(experiment.door(i).name(), i); !first) {
      throw loaded.locations.error(fmt::format("door[{}].name", i),
                                   fmt::format("a door has this name already, at {}; choose another",
                                               loaded.locations.where(fmt::format("door[{}]", found->second))));
    }
  }
}

}  // namespace kilotwin
