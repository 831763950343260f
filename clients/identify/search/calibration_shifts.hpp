/// Sudden calibration shifts of the camera: at one instant the whole image is displaced, rotated or rescaled. All
/// robots in view are affected at once, also those at rest. So a shift shows in the joint innovations of one
/// instant before any single track shows it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// One calibration shift and its uncertainty.
struct CalibrationShift {
  static constexpr int kNumbers = 4;  ///< shift along x and y (mm), rotation (rad), relative scale
  double time_s = 0;
  std::optional<std::uint32_t> run;  ///< run number in effects; nothing: at the same time in all runs
  Eigen::Vector4d size = Eigen::Vector4d::Zero(), sd = Eigen::Vector4d::Zero();
  double gain = 0;  ///< gain in half chi squared, with bounded influence of each track
  /// The same for the alternative: a push of all driven robots in the world frame.
  double gain_as_push = 0;
};

/// The most significant calibration shift in the tracks of the fit, with at least this gain. Nothing if none is
/// significant: false alarms occur in far fewer than one of a thousand sets.
[[nodiscard]] std::optional<CalibrationShift> find_calibration_shift(const Fitter&, const FitState&,
                                                                     double least_gain = 0);

/// Adds all calibration shifts to the model as one term of steps, and fits it. Pushes of driven robots are left to
/// other hypotheses, and so are displacements that last several frames. Returns the shifts. If there are none, the
/// model is unchanged.
std::vector<CalibrationShift> add_calibration_shifts(const Fitter&, FitState&, double least_gain = 0);

inline constexpr const char* kCalibrationShiftsName = "camera-shifts";

}  // namespace kilotwin::identify
