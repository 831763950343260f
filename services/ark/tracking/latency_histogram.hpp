/// A histogram of durations for quantiles: its memory does not grow, its relative resolution is 1 %.
#pragma once

#include <array>
#include <cstdint>

namespace kilotwin::ark {

class LatencyHistogram {
 public:
  /// Durations below a microsecond count as one microsecond, those above 17 minutes as 17 minutes.
  void add(double seconds);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// The duration that a share `p` (0..1) of all does not exceed, s; 0 where there is none.
  [[nodiscard]] double quantile_s(double p) const;

 private:
  static constexpr int kPerOctave = 70, kOctaves = 30;
  std::array<std::uint64_t, static_cast<std::size_t>(kPerOctave) * kOctaves> bins_{};
  std::uint64_t count_ = 0;
};

}  // namespace kilotwin::ark
