#include "clients/monitor/command_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/csv/csv_reader.hpp"

namespace kilotwin::monitor {

std::optional<MotionCommand> command_named(std::string_view name) {
  if (name == "stop") return MotionCommand::kStop;
  if (name == "straight") return MotionCommand::kStraight;
  if (name == "left") return MotionCommand::kTurnLeft;
  if (name == "right") return MotionCommand::kTurnRight;
  return std::nullopt;
}

CommandTable::CommandTable(const std::filesystem::path& file) {
  CsvReader table(file);
  read(table);
}

CommandTable::CommandTable(std::string name, std::string content) {
  CsvReader table(std::move(name), std::move(content));
  read(table);
}

void CommandTable::read(CsvReader& table) {
  table.require({"robot", "time_s", "motion"}, "a table of commands has robot,time_s,motion");
  const std::size_t robot = table.column("robot"), time = table.column("time_s"), motion = table.column("motion");
  const std::optional<std::size_t> run = table.find_column("run");
  std::optional<std::string> run_name;
  while (table.next()) {
    if (run && !run_name) run_name = table.text(*run);
    if (run && *run_name != table.text(*run)) {
      table.complain(
          *run, fmt::format("commands of a second run, after those of \"{}\"; give a table of one run", *run_name));
    }
    const auto command = command_named(table.text(motion));
    if (!command) {
      table.complain(
          motion, fmt::format("\"{}\" is no motion; expected stop, straight, left or right", table.text(motion)));
    }
    commands_[table.whole(robot)].push_back({table.number(time), *command});
  }
  for (auto& [id, changes] : commands_) {
    std::stable_sort(changes.begin(), changes.end(),
                     [](const Change& a, const Change& b) { return a.time_s < b.time_s; });
  }
}

void CommandTable::add(std::uint32_t robot, double time_s, MotionCommand command) {
  std::vector<Change>& changes = commands_[robot];
  // Stations repeat themselves.
  if (changes.empty() || changes.back().command != command) changes.push_back({time_s, command});
}

std::vector<std::uint32_t> CommandTable::robots() const {
  std::vector<std::uint32_t> robots;
  for (const auto& [robot, changes] : commands_) robots.push_back(robot);
  return robots;
}

MotionCommand CommandTable::at(std::uint32_t robot, double time_s) const {
  const auto found = commands_.find(robot);
  if (found == commands_.end()) return MotionCommand::kStop;
  const auto after = std::upper_bound(found->second.begin(), found->second.end(), time_s,
                                      [](double t, const Change& change) { return t < change.time_s; });
  return after == found->second.begin() ? MotionCommand::kStop : std::prev(after)->command;
}

Duties duties_of(MotionCommand command, const Calibration& own) {
  switch (command) {
    case MotionCommand::kStop: break;
    case MotionCommand::kStraight: return {own.straight_left, own.straight_right, 0};
    case MotionCommand::kTurnLeft: return {own.turn_left, 0, 0};
    case MotionCommand::kTurnRight: return {0, own.turn_right, 0};
  }
  return {};
}

}  // namespace kilotwin::monitor
