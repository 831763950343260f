#include "tests/reference/limits.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "clients/cli/sweep_points.hpp"
#include "clients/recorder/recording.hpp"
#include "core/dds/dds.hpp"
#include "core/experiment/fields.hpp"
#include "core/experiment/limits.hpp"
#include "core/logs/robot_logs.hpp"
#include "services/behaviours/image.hpp"
#include "services/comm/radio_counters.hpp"

namespace kilotwin::reference {
namespace {

std::string range_of(std::string_view field) {
  for (const FieldRule& rule : field_rules()) {
    if (rule.field == field) return range_text(rule) + (rule.unit.empty() ? "" : " ") + std::string{rule.unit};
  }
  throw std::runtime_error(fmt::format("core/experiment/fields.cpp has no rule for {}", field));
}

}  // namespace

std::string limits_table() {
  std::string table = "| what | limit | where it is set |\n|---|---|---|\n";
  const auto row = [&table](const char* what, const std::string& limit, const char* where) {
    table += fmt::format("| {} | {} | `{}` |\n", what, limit, where);
  };
  const auto number = [](auto value) { return fmt::format("{}", value); };
  row("robots of an experiment, all groups together", number(kMostRobots), "core/experiment/limits.hpp");
  row("robot groups", number(kMostGroups), "core/experiment/limits.hpp");
  row("movable bodies", number(kMostMovables), "core/experiment/limits.hpp");
  row("obstacles", number(kMostObstacles), "core/experiment/limits.hpp");
  row("effects of a model", number(kMostEffects), "core/experiment/limits.hpp");
  row("arena fields of a model", number(kMostFields), "core/experiment/limits.hpp");
  row("robots, where the station runs a virtual environment (ARK's messages carry 10-bit ids)",
      number(kMostArkRobots), "core/experiment/limits.hpp");
  row("simulated time of a run", range_of("Experiment.duration_s"), "core/experiment/fields.cpp");
  row("physics partitions along x", range_of("Deployment.partition_columns"), "core/experiment/fields.cpp");
  row("physics partitions along y", range_of("Deployment.partition_rows"), "core/experiment/fields.cpp");
  row("behaviours hosts", range_of("Deployment.hosts"), "core/experiment/fields.cpp");
  row("DDS domain", fmt::format("0..{}", dds::kLastDomain), "core/dds/dds.hpp");
  row("index of a DDS participant in its domain, per machine", fmt::format("0..{}", dds::kMostParticipants - 1),
      "core/dds/dds.hpp");
  row("services of a federated run on one machine", number(dds::kMostServices), "core/dds/dds.hpp");
  row("silence after which a federate counts as lost (2 s per 4 services and core, where there are more)",
      fmt::format("{} s", dds::kSilence_s), "core/dds/dds.hpp");
  row("stack of a simulated program (a robot has 2 KiB of RAM)",
      fmt::format("{} KiB", behaviours::kStackOctets / 1024), "services/behaviours/image.hpp");
  row("addresses of all programs of a run",
      fmt::format("{:#x} to {:#x}, {} MiB", behaviours::kFirstAddress, behaviours::kLastAddress,
                  (behaviours::kLastAddress - behaviours::kFirstAddress) >> 20),
      "services/behaviours/image.hpp");
  row("copies of a program in memory: robots of one program that run at the same time", number(behaviours::kSlots),
      "services/behaviours/image.hpp");
  row("log file of a robot", fmt::format("{} MiB", RobotLogs::kMostOctets >> 20), "core/logs/robot_logs.hpp");
  row("record of a recording", fmt::format("{} MiB", recorder::kLongestRecord_bytes >> 20),
      "clients/recorder/recording.hpp");
  row("runs of a sweep", number(cli::kMostSweepRuns), "clients/cli/sweep_points.hpp");
  return table;
}

std::string counters_table() {
  std::string table = "| name | counts, per robot, since the start of the run |\n|---|---|\n";
  for (const comm::RadioCounter& counter : comm::kRadioCounters)
    table += fmt::format("| `{}` | {} |\n", counter.name, counter.counts);
  return table;
}

}  // namespace kilotwin::reference
