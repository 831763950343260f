#include "clients/cli/recorded_variables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>

#include "clients/recorder/swarm_observables.hpp"
#include "core/base/error.hpp"
#include "core/observations/variable_sampler.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/program_variables.hpp"
#include "services/comm/radio_counters.hpp"

namespace kilotwin::cli {
namespace {

constexpr std::size_t kNamesInMessage = 12;

proto::VariablePlace place_of(const behaviours::ScalarVariable& scalar, std::uint32_t program) {
  proto::VariablePlace place;
  place.set_program(program);
  place.set_address(scalar.address);
  place.set_octets(scalar.octets);
  place.set_kind(static_cast<proto::VariablePlace::Kind>(scalar.kind));
  if (scalar.bits != 0) {
    place.set_bit_offset(scalar.bit_offset);
    place.set_bits(scalar.bits);
  }
  if (scalar.pointer_octets != 0) {
    place.set_pointer(scalar.pointer);
    place.set_pointer_octets(scalar.pointer_octets);
  }
  return place;
}

/// The variable of that name; made where it is new. A variable that is named twice is recorded once, as often as first said.
proto::ProgramVariable& entry_of(proto::Manifest& manifest, const std::string& name, double every_s) {
  for (proto::ProgramVariable& variable : *manifest.mutable_variable()) {
    if (variable.name() == name) return variable;
  }
  proto::ProgramVariable& variable = *manifest.add_variable();
  variable.set_name(name);
  variable.set_every_s(every_s);
  variable.set_integer(true);
  return variable;
}

void add_scalar(proto::Manifest& manifest, const behaviours::ScalarVariable& scalar, double every_s,
                std::uint32_t program) {
  proto::ProgramVariable& variable = entry_of(manifest, scalar.name, every_s);
  for (const proto::VariablePlace& place : variable.place()) {
    if (place.program() == program) return;
  }
  if (scalar.kind == behaviours::ScalarVariable::Kind::kFloat) variable.set_integer(false);
  *variable.add_place() = place_of(scalar, program);
}

/// Makes the entry of a variable that is no program's: the robots' battery, or a counter of the radio. False: the name is none of
/// these. Throws UserError, without a place, where it cannot be recorded.
bool add_observed(proto::Manifest& manifest, const std::string& name, double every_s,
                  const proto::Experiment& experiment, const std::vector<std::string>& elves) {
  const bool is_battery = name == kBatteryVariable;
  if (!is_battery && comm::radio_counter(name) == nullptr) return false;
  for (const std::string& elf : elves) {
    if (!behaviours::find_variable(elf, behaviours::VariablePath::parse(name)).empty())
      throw UserError(
          fmt::format("{} is {}, and a program has a variable of that name; give the program's another one", name,
                      is_battery ? "the voltage of the robots' batteries" : "a counter of the radio"));
  }
  if (is_battery && !experiment.has_battery())
    throw UserError(fmt::format("{}: the experiment has no batteries; add battery {{ }} to it", name));
  entry_of(manifest, name, every_s).set_integer(!is_battery);
  return true;
}

std::string names_in_words(const std::vector<std::string>& elves) {
  std::string text;
  std::size_t count = 0;
  for (const std::string& elf : elves) {
    for (const std::string& name : behaviours::variable_names(elf)) {
      if (++count > kNamesInMessage) return text + "...";
      text += (text.empty() ? "" : ", ") + name;
    }
  }
  return text;
}

}  // namespace

std::vector<std::string> contents_of(const std::vector<std::filesystem::path>& objects) {
  std::vector<std::string> elves;
  elves.reserve(objects.size());
  for (const std::filesystem::path& object : objects) elves.push_back(os::read_file(object));
  return elves;
}

void add_recorded_variables(const LoadedExperiment& loaded, const std::vector<std::filesystem::path>& objects,
                            proto::Manifest& manifest) {
  const proto::Recording& recording = manifest.experiment().recording();
  if (recording.variable_size() == 0) return;
  const std::vector<std::string> elves = contents_of(objects);
  for (int v = 0; v < recording.variable_size(); ++v) {
    const proto::RecordedVariable& wanted = recording.variable(v);
    const std::string place = fmt::format("recording.variable[{}].name", v);
    bool any = false;
    try {
      if (add_observed(manifest, wanted.name(), wanted.every_s(), loaded.experiment, elves)) continue;
      const auto path = behaviours::VariablePath::parse(wanted.name());
      for (std::uint32_t program = 0; program < elves.size(); ++program) {
        for (const auto& scalar : behaviours::find_variable(elves[program], path)) {
          add_scalar(manifest, scalar, wanted.every_s(), program);
          any = true;
        }
      }
    } catch (const UserError& error) {
      throw loaded.locations.error(place, error.what());
    }
    if (!any) {
      const std::string names = names_in_words(elves);
      throw loaded.locations.error(
          place,
          fmt::format("no program has a global or static variable \"{}\"; {}{}", wanted.name(),
                      wanted.name() == "battery" ? "the voltage of the robots' batteries is battery_V; " : "",
                      names.empty() ? "firmware needs an .elf file with debug information" : "there are " + names));
    }
    if (static_cast<std::size_t>(manifest.variable_size()) > behaviours::kMostScalars)
      throw loaded.locations.error(place, fmt::format("the variables have more than {} values; name parts of them",
                                                      behaviours::kMostScalars));
  }
}

void check_observables(const LoadedExperiment& loaded, const proto::Manifest& manifest) {
  constexpr int kMostObservables = 64;
  std::vector<std::string> variables;
  for (const proto::ProgramVariable& variable : manifest.variable()) variables.push_back(variable.name());
  std::set<std::string> names;
  for (int i = 0; i < loaded.experiment.observable_size(); ++i) {
    const proto::Observable& observable = loaded.experiment.observable(i);
    const std::string place = fmt::format("observable[{}]", i), &name = observable.name();
    if (i == kMostObservables)
      throw loaded.locations.error(place, fmt::format("there are {} observables; it takes at most {}",
                                                      loaded.experiment.observable_size(), kMostObservables));
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    if (name.empty() || name.size() > 60 || !letter(name[0]) || !std::all_of(name.begin(), name.end(), [&](char c) {
          return letter(c) || c == '_' || (c >= '0' && c <= '9');
        }))
      throw loaded.locations.error(
          place, fmt::format("\"{}\" is no name of an observable; it takes a letter, then letters, "
                             "digits and _, at most 60",
                             name));
    if (!names.insert(name).second || recorder::kind_of_name(name, variables) != recorder::NameKind::kUnknown)
      throw loaded.locations.error(place + ".name", fmt::format("the name {} is taken; give another one", name));
    try {
      static_cast<void>(recorder::Expression::parse(
          observable.value(), [&](const std::string& used) { return recorder::kind_of_name(used, variables); }));
    } catch (const UserError& error) {
      throw loaded.locations.error(observable.has_value() ? place + ".value" : place, error.what());
    }
  }
}

}  // namespace kilotwin::cli
