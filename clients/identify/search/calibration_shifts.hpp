/// Instants at which the whole picture jumps: a camera that is bumped, turned, zoomed or put right. All robots that are seen then
/// are displaced at once by one shift, turn and change of scale, those at rest too: what they show together is seen in the
/// filter's innovations of that one instant, long before any single track would show it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// What a picture does at an instant, and how sure that is.
struct Jump {
  static constexpr int kNumbers = 4;  ///< shift along x and y (mm), turn (rad), relative scale
  double time_s = 0;
  std::optional<std::uint32_t> run;  ///< by which effects know it; nothing: at the same time of all runs
  Eigen::Vector4d size = Eigen::Vector4d::Zero(), sd = Eigen::Vector4d::Zero();
  double gain = 0;  ///< in half chi squared, no track counting for much
  /// The same of a push in the room of all robots that are driven then.
  double gain_as_push = 0;
};

/// The most certain jump that the model leaves in the tracks that may be fitted to, of at least this gain. Nothing where none is
/// certain: there chance finds one in far fewer than one of a thousand sets.
[[nodiscard]] std::optional<Jump> find_jump(const Fitter&, const MotionModel&, double least_gain = 0);

/// Everything that jumps, put into the model as one term of steps, fitted. Pushes of the driven robots are no jumps and are
/// left to others, and so is what goes on for some frames. Returns the jumps; none: the model is as it was.
std::vector<Jump> add_jumps(const Fitter&, MotionModel&, double least_gain = 0);

inline constexpr const char* kJumpsName = "camera-jumps";

}  // namespace kilotwin::identify
