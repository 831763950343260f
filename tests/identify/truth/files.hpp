/// Data directories in the contract's form, and the true values.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// Writes trajectories.csv and commands.csv of some runs.
void write_data(const Scene& scene, const std::vector<Run>& runs, const std::filesystem::path& directory);

/// JSON: scene, effects, faults, biases, RMSE of the oracle on the test runs, and of an oracle without the
/// effects.
void write_truth(const Scene& scene, const Play& play, double oracle_rmse_mm, double blind_rmse_mm,
                 const std::filesystem::path& file);

/// Columns run,robot,time_s,x_mm,y_mm,truth_x_mm,truth_y_mm.
void write_predictions(const std::vector<Prediction>& predictions, const std::filesystem::path& file);

}  // namespace kilotwin::truth
