/// Random numbers of the test data, independent of the project's; the same with every compiler.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace kilotwin::truth {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  /// 0 .. count - 1.
  int pick(int count) { return static_cast<int>(uniform() * count); }

  /// Mean 0, standard deviation 1: the polar method.
  double normal() {
    if (snapshots_) {
      snapshots_ = false;
      return spare_value_;
    }
    double u = 0, v = 0, s = 0;
    do {
      u = between(-1, 1);
      v = between(-1, 1);
      s = u * u + v * v;
    } while (s >= 1 || s == 0);
    const double stretch = std::sqrt(-2 * std::log(s) / s);
    snapshots_ = true;
    spare_value_ = v * stretch;
    return u * stretch;
  }

 private:
  std::mt19937_64 engine_;
  bool snapshots_ = false;
  double spare_value_ = 0;
};

}  // namespace kilotwin::truth
