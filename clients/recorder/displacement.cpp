#include "clients/recorder/displacement.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/error.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::recorder {

void DisplacementObserver::add(std::span<const double> x_mm, std::span<const double> y_mm) {
  if (start_x_mm_.empty()) {
    start_x_mm_.assign(x_mm.begin(), x_mm.end());
    start_y_mm_.assign(y_mm.begin(), y_mm.end());
  }
  KILOTWIN_DEMAND(x_mm.size() == start_x_mm_.size() && y_mm.size() == start_y_mm_.size());
  stats::Moments distances;
  max_distance_mm_ = 0;
  for (std::size_t i = 0; i < x_mm.size(); ++i) {
    if (i < left_out_.size() && left_out_[i] != 0) continue;
    const double dx = x_mm[i] - start_x_mm_[i], dy = y_mm[i] - start_y_mm_[i];
    const double distance = std::sqrt(dx * dx + dy * dy);
    distances.add(distance);
    max_distance_mm_ = std::max(max_distance_mm_, distance);
  }
  mean_distance_mm_ = distances.mean();
}

void DisplacementObserver::leave_out(std::size_t robot) {
  if (left_out_.size() <= robot) left_out_.resize(robot + 1, 0);
  left_out_[robot] = 1;
}

}  // namespace kilotwin::recorder
