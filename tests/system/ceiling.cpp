#include "tests/system/ceiling.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kilotwin::test {

std::string Ceiling::size() const { return fmt::format("{}x{}", width_px, height_px); }
std::string Ceiling::arena() const { return fmt::format("{}x{}", width_mm, height_mm); }

std::string Ceiling::calibration() const {
  constexpr double kMargin_mm = 40;  // floor beyond the walls that such a camera shows
  const double px_per_mm =
      std::min(width_px / (width_mm + 2 * kMargin_mm), height_px / (height_mm + 2 * kMargin_mm));
  std::string text = "%YAML:1.0\n---\n";
  for (int corner = 0; corner < 4; ++corner) {
    const double x = (corner % 2 == 0 ? -0.5 : 0.5) * width_mm * px_per_mm + 0.5 * (width_px - 1);
    const double y = (corner / 2 == 0 ? -0.5 : 0.5) * height_mm * px_per_mm + 0.5 * (height_px - 1);
    text += fmt::format("corner{}: [ {:.6f}, {:.6f} ]\n", corner + 1, x, y);
  }
  return text;
}

}  // namespace kilotwin::test
