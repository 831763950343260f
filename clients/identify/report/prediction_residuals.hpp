/// Residuals of predictions, measured minus predicted: by robot, over the arena, and over covariates.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/prediction.hpp"

namespace kilotwin::identify {

/// The entries `robots`, `maps` and `covariate_plots` of the document (identify.hpp) for predictions with horizon
/// `horizon_s`, s:
///   robots           rms residual before and after, by robot
///   maps             mean residual along x and y, by the robot's position at half the horizon
///   covariate_plots  for each covariate, the residual component that depends on it most: ahead and left of the
///                    displacement that the base model predicts, or x and y in the world frame
/// Measured positions are interpolated over gaps up to 2.5 s; predictions without a measurement are left out. The
/// standard errors account for overlapping windows.
[[nodiscard]] nlohmann::json residual_parts(const MeasuredSet&, const std::vector<Prediction>&, double horizon_s);

}  // namespace kilotwin::identify
