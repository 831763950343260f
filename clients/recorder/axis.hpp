/// Steps of scale bars.
#pragma once

namespace kilotwin::recorder {

/// 1, 2 or 5 times a power of ten: the least that cuts `range` (> 0) into at most `pieces`.
[[nodiscard]] double round_step(double range, int pieces);

}  // namespace kilotwin::recorder
