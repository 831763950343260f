// Trackers, and what tracked robots say: what the table of ranges cannot say.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>

#include "core/experiment/field_checks.hpp"
#include "core/experiment/limits.hpp"

namespace kilotwin {
namespace {

constexpr int kMostTrackers = 16, kMostRules = 256, kMessageOctets = 9, kLedChannels = 3;
/// TrackerFrame.source in idl/public.idl holds 64 octets with the closing zero.
constexpr std::size_t kLongestSource = 63;

void check_trackers(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  if (experiment.tracker_size() > kMostTrackers) {
    throw loaded.locations.error(
        fmt::format("tracker[{}]", kMostTrackers),
        fmt::format("there are {} trackers; at most {} are right", experiment.tracker_size(), kMostTrackers));
  }
  std::set<std::string> sources;
  for (int i = 0; i < experiment.tracker_size(); ++i) {
    const std::string& source = experiment.tracker(i).source();
    const std::string path = fmt::format("tracker[{}]", i);
    if (source.empty())
      throw loaded.locations.error(path, "source is missing; state source: \"NAME\", as the tracker's samples do");
    if (source.size() > kLongestSource) {
      throw loaded.locations.error(path + ".source", fmt::format("source has {} octets; it takes at most {}",
                                                                 source.size(), kLongestSource));
    }
    if (!sources.insert(source).second) {
      throw loaded.locations.error(
          path + ".source", fmt::format("source \"{}\" has a block already; write one block per tracker", source));
    }
  }
}

void check_rule(const LoadedExperiment& loaded, const proto::SaysRule& rule, const std::string& path,
                std::uint64_t first, std::uint64_t count) {
  if (rule.data_size() > kMessageOctets) {
    throw loaded.locations.error(path + ".data", fmt::format("data has {} octets; a message has at most {}",
                                                             rule.data_size(), kMessageOctets));
  }
  if (rule.led_size() != 0 && rule.led_size() != kLedChannels) {
    throw loaded.locations.error(path + ".led",
                                 fmt::format("led has {} numbers; it takes red, green and blue", rule.led_size()));
  }
  if (rule.has_circle() && !rule.circle().has_radius_mm())
    throw loaded.locations.error(path + ".circle", "radius_mm is missing; state radius_mm: LENGTH");
  for (int i = 0; i < rule.robot_size(); ++i) {
    if (rule.robot(i) >= first && rule.robot(i) - first < count) continue;
    throw loaded.locations.error(fmt::format("{}.robot[{}]", path, i),
                                 fmt::format("robot {} is not of this group; its robots are {} to {}",
                                             rule.robot(i), first, first + count - 1));
  }
}

bool has_listener(const proto::Experiment& experiment) {
  return std::any_of(experiment.door().begin(), experiment.door().end(),
                     [](const proto::Door& door) { return door.has_listener(); });
}

void check_hearing(const LoadedExperiment& loaded, const proto::RobotGroup& group, const std::string& path) {
  if (!group.has_hears_simulated()) return;
  if (group.body() != proto::RobotGroup::TRACKED) {
    throw loaded.locations.error(
        path, "simulated robots hear by their own radio; remove hears_simulated, or set body: TRACKED");
  }
  const auto& environments = loaded.experiment.station().environment();
  if (std::any_of(environments.begin(), environments.end(), [](const auto& each) { return each.has_bits(); })) {
    throw loaded.locations.error(
        path,
        "its messages take all bits of a message, and environments of the station have bits of their own; "
        "remove bits from the environments, or hears_simulated");
  }
}

}  // namespace

void check_tracking(const LoadedExperiment& loaded) {
  check_trackers(loaded);
  const proto::Experiment& experiment = loaded.experiment;
  std::uint64_t first = 0;
  bool counted = true;  // a CSV file of poses knows its number of robots only later
  for (int g = 0; g < experiment.robots_size(); ++g) {
    const proto::RobotGroup& group = experiment.robots(g);
    const std::string path = fmt::format("robots[{}].says", g);
    if (group.has_says() && group.body() != proto::RobotGroup::TRACKED) {
      throw loaded.locations.error(
          path, "simulated robots say what their program says; remove says, or set body: TRACKED");
    }
    const proto::Says& says = group.says();
    if ((says.shadow() ? 1 : 0) + (says.heard() ? 1 : 0) + (says.rule_size() > 0 ? 1 : 0) > 1)
      throw loaded.locations.error(path, "says has more than one of rule, shadow and heard; keep one of them");
    if (says.heard() && !has_listener(experiment)) {
      throw loaded.locations.error(
          path + ".heard",
          "no listener tells what the robots say; add door { name: \"NAME\" listener { robot: NUMBER } }");
    }
    check_hearing(loaded, group, fmt::format("robots[{}].hears_simulated", g));
    if (says.shadow() && group.avr())
      throw loaded.locations.error(path + ".shadow", "a shadow runs natively; remove avr");
    if (says.rule_size() > kMostRules) {
      throw loaded.locations.error(
          path, fmt::format("there are {} rules; at most {} are right", says.rule_size(), kMostRules));
    }
    const std::uint64_t count = stated_count(group);
    counted = counted && count > 0;
    for (int i = 0; i < says.rule_size(); ++i) {
      check_rule(loaded, says.rule(i), fmt::format("{}.rule[{}]", path, i), first, counted ? count : kMostRobots);
    }
    first += count;
  }
}

}  // namespace kilotwin
