/// Loading of an experiment's file, and changes by the command line before the experiment is checked.
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

  /// The path of a file that the experiment names relative to its own folder.
  [[nodiscard]] std::filesystem::path resolve(const std::string& name) const { return file.parent_path() / name; }
};

/// Reads an experiment. Checks only grammar and types; validate.hpp checks ranges and meaning. If `name` is missing, it becomes the
/// file's name without ending; characters other than letters, digits, '-' and '_' become '-'. Throws UserError
/// "FILE:LINE:COLUMN: ...".
[[nodiscard]] LoadedExperiment load_experiment(const std::filesystem::path& file);

/// `--model FILE`: merges a proto::Model into experiment.motion and experiment.robot_model, robot by robot. If it has effects or
/// fields, they replace those of the experiment. Throws UserError with a place in the model file, and then changes nothing.
void apply_model(LoadedExperiment& loaded, const std::filesystem::path& file);

/// Sets one field: "path.to[2].field=value". An omitted index means 0; an index one past the end appends; missing messages on the
/// path are created. Text needs no quotes, enum values are names. `option` is the argument's name in errors, also those of
/// later validation; empty: "--set ARGUMENT". Changes nothing if it throws UserError.
void apply_override(LoadedExperiment& loaded, std::string_view argument, std::string_view option = {});

/// `--robots N`: sets the first group's count.
void set_robots(LoadedExperiment& loaded, std::uint32_t count);
/// `--behaviour FILE`: sets the first group's program. The path is relative to the working directory.
void set_behaviour(LoadedExperiment& loaded, const std::filesystem::path& program);

}  // namespace kilotwin
