#include "clients/identify/model/contact_geometry.hpp"

#include <cmath>

namespace kilotwin::identify {

bool push_apart(std::vector<double>& x_mm, std::vector<double>& y_mm) {
  bool any = false;
  for (std::size_t i = 0; i < x_mm.size(); ++i) {
    for (std::size_t j = i + 1; j < x_mm.size(); ++j) {
      const double dx = x_mm[j] - x_mm[i], dy = y_mm[j] - y_mm[i], square = dx * dx + dy * dy;
      if (!(square < kDiscDiameter_mm * kDiscDiameter_mm) || square < 1e-6) continue;
      const double distance = std::sqrt(square), half = (kDiscDiameter_mm - distance) / 2 / distance;
      x_mm[i] -= half * dx;
      y_mm[i] -= half * dy;
      x_mm[j] += half * dx;
      y_mm[j] += half * dy;
      any = true;
    }
  }
  return any;
}

}  // namespace kilotwin::identify
