/// How much wider scores spread than the model says. It is learned while robots warm up, over all of them.
#pragma once

#include <algorithm>
#include <array>

#include "clients/monitor/hypotheses.hpp"

namespace kilotwin::monitor {

class Dispersion {
 public:
  /// The ratio of a squared score to its information over a block of time: 1 on average under the model.
  void add(Group group, double ratio) {
    Sum& sum = sums_[static_cast<std::size_t>(group)];
    sum.ratios += std::min(ratio, kLargest);
    sum.count += 1;
  }
  /// At least 1: data that fit better than the model says do not make tests sharper.
  [[nodiscard]] double of(Group group) const {
    const Sum& sum = sums_[static_cast<std::size_t>(group)];
    return std::max(1.0, (sum.ratios + kPrior) / (sum.count + kPrior));
  }

 private:
  /// One robot that fails while it warms up must not blind the tests of all.
  static constexpr double kLargest = 10;
  /// Blocks that count as if their ratio had been 1.
  static constexpr double kPrior = 10;
  struct Sum {
    double ratios = 0, count = 0;
  };
  std::array<Sum, static_cast<std::size_t>(Group::kCount)> sums_{};
};

}  // namespace kilotwin::monitor
