#include "clients/cli/page_recording.hpp"

#include <algorithm>

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

/// Whether the name stands for one scalar. Arrays and structs are left to the experiment, and so is what cannot be read.
bool is_scalar(const std::string& elf, const std::string& name) {
  try {
    return behaviours::find_variable(elf, behaviours::VariablePath::parse(name)).size() == 1;
  } catch (const UserError&) {
    return false;
  }
}

bool has_variable(const std::vector<std::string>& elves, const std::string& name) {
  return std::any_of(elves.begin(), elves.end(), [&](const std::string& elf) {
    const std::vector<std::string> names = behaviours::variable_names(elf);
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

}  // namespace

void record_for_page(const std::vector<std::string>& elves, proto::Recording& recording) {
  add_event(proto::SENT, recording);
  add_event(proto::RECEIVED, recording);
  for (const comm::RadioCounter& counter : comm::kRadioCounters) {
    if (!has_variable(elves, std::string{counter.name})) add_variable(counter.name, recording);
  }
  std::vector<std::string> scalars;
  for (const std::string& elf : elves) {
    for (const std::string& name : behaviours::variable_names(elf)) {
      if (name == kBatteryVariable || comm::radio_counter(name) != nullptr)
        continue;  // names with a meaning of their own
      const bool readable_everywhere = std::all_of(elves.begin(), elves.end(), [&](const std::string& other) {
        return !has_variable({other}, name) || is_scalar(other, name);
      });
      if (readable_everywhere && std::find(scalars.begin(), scalars.end(), name) == scalars.end())
        scalars.push_back(name);
    }
  }
  if (scalars.size() > kMostVariablesForPage) scalars.resize(kMostVariablesForPage);
  for (const std::string& name : scalars) add_variable(name, recording);
}

}  // namespace kilotwin::cli
