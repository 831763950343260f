/// Length of scale bars.
#pragma once

namespace kilotwin::recorder {

/// The smallest of 1, 2 or 5 times a power of ten that divides `range` (> 0) into at most `pieces` parts.
[[nodiscard]] double round_step(double range, int pieces);

}  // namespace kilotwin::recorder
