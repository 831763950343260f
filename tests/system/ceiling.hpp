/// A camera under the ceiling of one experiment, which plays the real world of another: what both sides have to know.
#pragma once

#include <string>

namespace kilotwin::test {

/// A camera of `kilotwin cameras` that sees the whole rectangular arena.
struct Ceiling {
  double width_mm, height_mm;  ///< of the arena
  int width_px = 640, height_px = 480;

  /// For `cameras --size` and `track --arena`.
  [[nodiscard]] std::string size() const;
  [[nodiscard]] std::string arena() const;
  /// For `track --calibration`: where the arena's corners appear in the picture.
  [[nodiscard]] std::string calibration() const;
};

}  // namespace kilotwin::test
