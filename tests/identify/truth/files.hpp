/// Data directories as the contract has them, and what is true of them.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// trajectories.csv and commands.csv of some runs.
void write_data(const Scene& scene, const std::vector<Run>& runs, const std::filesystem::path& directory);

/// Scene, effects, faults, biases, the oracle's RMSE of the test runs, and that of one who knows all but the effects, as JSON.
void write_truth(const Scene& scene, const Play& play, double oracle_rmse_mm, double blind_rmse_mm,
                 const std::filesystem::path& file);

/// run,robot,time_s,x_mm,y_mm,truth_x_mm,truth_y_mm
void write_predictions(const std::vector<Prediction>& predictions, const std::filesystem::path& file);

}  // namespace kilotwin::truth
