/// Declared commands: what robots were commanded to do, from a table in the format of measured data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.hpp"
#include "core/effects/robots.hpp"
#include "core/model/robot_parameters.hpp"

namespace kilotwin {
class CsvReader;
}

namespace kilotwin::monitor {

/// stop, straight, left or right.
[[nodiscard]] std::optional<MotionCommand> command_named(std::string_view name);

class CommandTable {
 public:
  /// No commands.
  CommandTable() = default;
  /// Reads robot,time_s,motion; docs/reference/measured-data.md has the columns. A column `run` must hold one name. Throws
  /// UserError with file, line and column.
  explicit CommandTable(const std::filesystem::path& file);
  /// The same of a table in memory; `name` stands for the file in errors.
  CommandTable(std::string name, std::string content);

  /// From that time on; times of a robot ascend.
  void add(std::uint32_t robot, double time_s, MotionCommand command);
  /// Ascending ids of the robots that have commands.
  [[nodiscard]] std::vector<std::uint32_t> robots() const;
  [[nodiscard]] bool has(std::uint32_t robot) const { return commands_.contains(robot); }
  /// The robot's command at an instant: at rest before the first.
  [[nodiscard]] MotionCommand at(std::uint32_t robot, double time_s) const;

 private:
  struct Change {
    double time_s;
    MotionCommand command;
  };
  void read(CsvReader& table);

  std::map<std::uint32_t, std::vector<Change>> commands_;
};

/// The duties of a command at a robot's calibration.
[[nodiscard]] Duties duties_of(MotionCommand command, const Calibration& calibration);

}  // namespace kilotwin::monitor
