#include "services/ark/tracking/latency_histogram.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::ark {
namespace {

constexpr double kLeast_s = 1e-6;

}  // namespace

void LatencyHistogram::add(double seconds) {
  const double octaves = std::log2(std::max(seconds, kLeast_s) / kLeast_s);
  const auto bin = std::min(static_cast<std::size_t>(octaves * kPerOctave), bins_.size() - 1);
  ++bins_[bin];
  ++count_;
}

double LatencyHistogram::quantile_s(double p) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(p * static_cast<double>(count_)));
  std::uint64_t below = 0;
  std::size_t bin = 0;
  while (bin + 1 < bins_.size() && below + bins_[bin] < std::max<std::uint64_t>(wanted, 1)) below += bins_[bin++];
  return kLeast_s * std::exp2((static_cast<double>(bin) + 1) / kPerOctave);
}

}  // namespace kilotwin::ark
