/// Readings of the two receiver amplifiers as functions of the sender's distance.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace kilotwin {

struct Gains {
  std::int16_t high, low;  ///< 10-bit ADC counts
  bool operator==(const Gains&) const = default;
};

/// The nominal calibration of core/base/ir_calibration.h. Readings are linear between its entries. Beyond the last entry they
/// decay exponentially with the length constant of the table's curve. A distance below contact stands for a signal that is
/// stronger than a nominal sender's at contact: the low gain rises up to 1023, the high gain is saturated.
class Ranging {
 public:
  Ranging();
  /// `distance_mm`: between disc centres.
  [[nodiscard]] Gains gains(double distance_mm) const {
    const double step = (distance_mm - kContact_mm) * (1.0 / kStep_mm);
    if (!(step > 0)) return rounded(high_[0], std::min(low_[0] + step * (low_[1] - low_[0]), kMost));
    if (step >= kEntries - 1) return {0, 0};
    const auto i = static_cast<std::size_t>(step);
    const double part = step - static_cast<double>(i);
    return rounded(high_[i] + part * (high_[i + 1] - high_[i]), low_[i] + part * (low_[i + 1] - low_[i]));
  }

 private:
  static constexpr double kContact_mm = 33, kStep_mm = 5, kMost = 1023;
  /// Beyond entry 60, at 333 mm, readings are below half a count.
  static constexpr int kEntries = 61;

  /// Of numbers above 0, in the inner loop of the channel.
  static Gains rounded(double high, double low) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings)
    return {static_cast<std::int16_t>(high + 0.5), static_cast<std::int16_t>(low + 0.5)};
  }
  std::array<double, kEntries> high_, low_;
};

}  // namespace kilotwin
