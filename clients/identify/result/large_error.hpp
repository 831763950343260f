/// When an error counts as large.
#pragma once

namespace kilotwin::identify {

/// Least ratio of an error to the model's own expectation, to repetitions or to the noise floor that counts as large.
/// These are estimates without an interval of their own. At this ratio, the systematic part is sqrt(1.15^2 - 1) = 57 %
/// of the expected error. A smaller ratio calls more noise unexplained; a larger one hides systematic errors.
inline constexpr double kLargeErrorRatio = 1.15;

}  // namespace kilotwin::identify
