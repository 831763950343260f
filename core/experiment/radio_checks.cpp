// Checks of the infrared channel that the table of ranges cannot express.
#include <fmt/format.h>

#include <map>
#include <utility>

#include "core/base/ir_calibration.h"
#include "core/experiment/field_checks.hpp"

namespace kilotwin {
namespace {

using proto::Radio;

constexpr int kMostPatternEntries = 24;

void check_use(const LoadedExperiment& loaded) {
  const Radio& radio = loaded.experiment.radio();
  const auto refuse = [&](const char* field, bool given, Radio::Model needed) {
    if (!given || radio.model() == needed) return;
    throw loaded.locations.error(std::string{"radio."} + field,
                                 fmt::format("{} has no effect with model: {}; set model: {}, or remove it", field,
                                             Radio::Model_Name(radio.model()), Radio::Model_Name(needed)));
  };
  refuse("propagation", radio.has_propagation(), Radio::PROPAGATION);
  refuse("simple", radio.has_simple(), Radio::SIMPLE);
  for (const auto& [given, field] : {std::pair{radio.propagation().has_range_mm(), "range_mm"},
                                     std::pair{radio.propagation().has_oscillator_sd(), "oscillator_sd"}}) {
    if (!given) continue;
    throw loaded.locations.error(std::string{"radio.propagation."} + field,
                                 fmt::format("{} is for model files; state radio.{} here", field, field));
  }
}

void check_pattern(const LoadedExperiment& loaded, const char* field, int entries) {
  if (entries <= kMostPatternEntries && entries % 2 == 0) return;
  throw loaded.locations.error(
      std::string{"radio.propagation."} + field,
      fmt::format("{} has {} entries; it takes pairs, the cosine's and the sine's, at most {} entries", field,
                  entries, kMostPatternEntries));
}

void check_tables(const LoadedExperiment& loaded, const proto::RobotRadio& robot, const std::string& path) {
  const auto fits = [](const auto& table) {
    for (int i = 1; i < table.size(); ++i) {
      if (table.Get(i) > table.Get(i - 1)) return false;
    }
    return table.empty() || table.size() == KILOTWIN_IR_ENTRIES;
  };
  const bool both = robot.ir_high().empty() == robot.ir_low().empty();
  if (both && fits(robot.ir_high()) && fits(robot.ir_low())) return;
  throw loaded.locations.error(
      path,
      fmt::format("ir_high and ir_low are wrong; each takes {} readings, none above the one before, or neither "
                  "has any",
                  KILOTWIN_IR_ENTRIES));
}

void check_robots(const LoadedExperiment& loaded) {
  const proto::Propagation& model = loaded.experiment.radio().propagation();
  std::map<std::uint32_t, int> entry_of;
  for (int i = 0; i < model.robot_size(); ++i) {
    const std::string path = fmt::format("radio.propagation.robot[{}]", i);
    if (!model.robot(i).has_robot()) {
      throw loaded.locations.error(path, "robot is missing; state robot: ID, the robot that the entry is about");
    }
    if (const auto [earlier, first] = entry_of.emplace(model.robot(i).robot(), i); !first) {
      throw loaded.locations.error(
          path, fmt::format("robot {} has an entry already, at {}; keep one of them", earlier->first,
                            loaded.locations.where(fmt::format("radio.propagation.robot[{}]", earlier->second))));
    }
    check_tables(loaded, model.robot(i), path);
  }
}

void check_links(const LoadedExperiment& loaded) {
  const proto::Propagation& model = loaded.experiment.radio().propagation();
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> link_of;
  for (int i = 0; i < model.link_size(); ++i) {
    const proto::RadioLink& link = model.link(i);
    const std::string path = fmt::format("radio.propagation.link[{}]", i);
    if (!link.has_sender() || !link.has_receiver()) {
      throw loaded.locations.error(path, "sender or receiver is missing; state both, sender: ID receiver: ID");
    }
    if (const auto [earlier, first] = link_of.emplace(std::pair{link.sender(), link.receiver()}, i); !first) {
      throw loaded.locations.error(
          path, fmt::format("the link from {} to {} has an entry already, at {}; keep one of them", link.sender(),
                            link.receiver(),
                            loaded.locations.where(fmt::format("radio.propagation.link[{}]", earlier->second))));
    }
  }
}

}  // namespace

void check_radio(const LoadedExperiment& loaded) {
  const proto::Propagation& model = loaded.experiment.radio().propagation();
  check_use(loaded);
  check_pattern(loaded, "power_pattern_db", model.power_pattern_db_size());
  check_pattern(loaded, "sensitivity_pattern_db", model.sensitivity_pattern_db_size());
  check_robots(loaded);
  check_links(loaded);
}

}  // namespace kilotwin
