/// The boundary of all visited places, in measured coordinates. Under camera distortion straight walls look
/// curved, so the fit first assumes possible walls anywhere along this boundary.
#pragma once

#include <array>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

class VisitedBoundary {
 public:
  /// From all positions of the set. Within `margin_mm` of the boundary, a robot may be in contact with a wall.
  VisitedBoundary(const MeasuredSet&, double margin_mm);
  [[nodiscard]] bool is_near(double x_mm, double y_mm) const;

 private:
  /// The boundary on one side, as a function of the coordinate along the side.
  struct Side {
    bool of_x;
    double sign;
    double first_mm = 0;              ///< middle of the first strip
    std::vector<double> farthest_mm;  ///< outermost coordinate of each strip
    [[nodiscard]] double at(double along_mm) const;
  };
  std::array<Side, 4> sides_;
  double margin_mm_;
};

}  // namespace kilotwin::identify
