/// Observables that are chosen by name: those of every swarm and those of an experiment.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "clients/recorder/observables.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::cli {

/// The observable of every swarm that has this name; nothing if there is none.
[[nodiscard]] std::optional<recorder::Observable> built_in_observable(const std::string& name);

/// Throws UserError, which names `option` and lists the observables, where `name` is none.
void check_observable(const std::string& option, const std::string& name, const proto::Experiment& experiment);

/// Its value in the last recorded state of a run; NaN where it is undefined. Throws where the recording cannot be read.
[[nodiscard]] double observable_at_end(const std::filesystem::path& run, const std::string& name);

}  // namespace kilotwin::cli
