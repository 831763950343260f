/// The rim of what robots reached, as the tracker shows it: walls are somewhere along it, whatever the picture makes of straight
/// lines, and round ones too.
#pragma once

#include <array>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

class Rim {
 public:
  /// Of all places of the set; robots within `margin_mm` of the farthest may touch what holds them.
  Rim(const MeasuredSet&, double margin_mm);
  [[nodiscard]] bool holds(double x_mm, double y_mm) const;

 private:
  /// The farthest places on one side, by the coordinate along it.
  struct Side {
    bool of_x;
    double sign;
    double first_mm = 0;              ///< middle of the first strip
    std::vector<double> farthest_mm;  ///< outwards, by strip
    [[nodiscard]] double at(double along_mm) const;
  };
  std::array<Side, 4> sides_;
  double margin_mm_;
};

}  // namespace kilotwin::identify
