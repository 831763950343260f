/// Shadow test: whether a robot's body stands between a sensor and a lamp. Bodies are upright cylinders.
#pragma once

#include <cstdint>
#include <vector>

#include "core/senses/light_source.hpp"

namespace kilotwin::senses {

class Shadows {
 public:
  /// `height_mm`: height of all bodies above the floor.
  explicit Shadows(double height_mm) : height_mm_(height_mm) {}

  /// Sorts bodies with these centres into cells. The arrays must outlive the calls of hides().
  void prepare(const std::vector<double>& x_mm, const std::vector<double>& y_mm);

  /// Whether the straight line from (x, y, z) to the lamp passes through a body other than number `self`. A tangent does not.
  [[nodiscard]] bool hides(const Lamp& lamp, double x_mm, double y_mm, double z_mm, std::uint32_t self) const;

 private:
  double height_mm_;
  const std::vector<double>* x_mm_ = nullptr;
  const std::vector<double>* y_mm_ = nullptr;
  double left_mm_ = 0, bottom_mm_ = 0, cell_mm_ = 1;
  std::uint32_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< per cell, plus one: index in body_ of the cell's first body
  std::vector<std::uint32_t> body_, cell_of_;
};

}  // namespace kilotwin::senses
