#include "clients/cli/page_recording.hpp"

#include <algorithm>
#include <set>

#include "core/base/error.hpp"
#include "core/observations/variable_sampler.hpp"
#include "services/behaviours/program_variables.hpp"
#include "services/comm/radio_counters.hpp"

namespace kilotwin::cli {
namespace {

constexpr double kVariableEvery_s = 1;

void add_event(proto::RecordedEvent event, proto::Recording& recording) {
  if (std::find(recording.event().begin(), recording.event().end(), event) == recording.event().end())
    recording.add_event(event);
}

bool records(const proto::Recording& recording, std::string_view name) {
  return std::any_of(recording.variable().begin(), recording.variable().end(),
                     [name](const proto::RecordedVariable& variable) { return variable.name() == name; });
}

void add_variable(std::string_view name, proto::Recording& recording) {
  if (records(recording, name)) return;
  proto::RecordedVariable& variable = *recording.add_variable();
  variable.set_name(std::string{name});
  variable.set_every_s(kVariableEvery_s);
}

/// A program, and the names of its variables.
struct Program {
  const std::string& elf;
  std::set<std::string> names;
};

/// Whether the name stands for one scalar, or for nothing. Arrays and structs are left to the experiment, and so is what cannot be
/// read.
bool is_scalar_if_there(const Program& program, const std::string& name) {
  if (!program.names.contains(name)) return true;
  try {
    return behaviours::find_variable(program.elf, behaviours::VariablePath::parse(name)).size() == 1;
  } catch (const UserError&) {
    return false;
  }
}

/// How many values the recording has already: of its variables in the program that has most.
std::size_t values_of(const proto::Recording& recording, const std::vector<Program>& programs) {
  std::size_t values = 0;
  for (const proto::RecordedVariable& variable : recording.variable()) {
    std::size_t most = 1;
    for (const Program& program : programs) {
      try {
        most = std::max(
            most, behaviours::find_variable(program.elf, behaviours::VariablePath::parse(variable.name())).size());
      } catch (const UserError&) {
        // The experiment's error is reported later, with its place.
      }
    }
    values += most;
  }
  return values;
}

}  // namespace

void record_for_page(const std::vector<std::string>& elves, proto::Recording& recording) {
  add_event(proto::SENT, recording);
  add_event(proto::RECEIVED, recording);
  std::vector<Program> programs;
  for (const std::string& elf : elves) {
    const std::vector<std::string> names = behaviours::variable_names(elf);
    programs.push_back({elf, {names.begin(), names.end()}});
  }
  const auto is_program_s = [&](const std::string& name) {
    return std::any_of(programs.begin(), programs.end(),
                       [&](const Program& one) { return one.names.contains(name); });
  };
  std::size_t values = values_of(recording, programs);
  const auto add = [&](const std::string& name) {
    if (values == behaviours::kMostScalars || records(recording, name)) return;
    add_variable(name, recording);
    ++values;
  };
  for (const comm::RadioCounter& counter : comm::kRadioCounters) {
    if (const std::string name{counter.name}; !is_program_s(name)) add(name);
  }
  std::set<std::string> tried;
  std::size_t added = 0;
  for (const Program& program : programs) {
    for (const std::string& name : program.names) {
      if (added == kMostVariablesForPage) return;
      if (name == kBatteryVariable || comm::radio_counter(name) != nullptr)
        continue;  // names with a meaning of their own
      if (!tried.insert(name).second) continue;
      if (!std::all_of(programs.begin(), programs.end(),
                       [&](const Program& one) { return is_scalar_if_there(one, name); }))
        continue;
      add(name);
      ++added;
    }
  }
}

}  // namespace kilotwin::cli
