/// An experiment as read from its file, and what the command line may change in it before it is checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "core/experiment/text_file.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin {

struct LoadedExperiment {
  proto::Experiment experiment;
  std::filesystem::path file;
  SourceLocations locations;

  /// A file that the experiment names, relative to the experiment's own.
  [[nodiscard]] std::filesystem::path resolve(const std::string& name) const { return file.parent_path() / name; }
};

/// Reads an experiment. Checks grammar and types alone; see validate.hpp for ranges and meaning. A missing name
/// becomes the file's name without its ending, other characters than letters, digits, '-' and '_' replaced by '-'.
/// Throws UserError "FILE:LINE:COLUMN: ...".
[[nodiscard]] LoadedExperiment load_experiment(const std::filesystem::path& file);

/// `--model FILE`: merges a proto::Model over experiment.motion and experiment.robot_model, robot by robot. Its effects and
/// fields, where it has any, replace the experiment's.
/// Throws UserError that names a place in the model file, and then changes nothing.
void apply_model(LoadedExperiment& loaded, const std::filesystem::path& file);

/// Sets one field: "path.to[2].field=value". An index left out is 0; an index one past the end appends; messages on
/// the way are created. Text needs no quotes, enum values go by name. `option` is how errors, now or in validation,
/// call the argument; empty: "--set ARGUMENT". Changes nothing if it throws UserError.
void apply_override(LoadedExperiment& loaded, std::string_view argument, std::string_view option = {});

/// `--robots N`: the first group's count.
void set_robots(LoadedExperiment& loaded, std::uint32_t count);
/// `--behaviour FILE`: the first group's program, relative to the working directory.
void set_behaviour(LoadedExperiment& loaded, const std::filesystem::path& program);

}  // namespace kilotwin
