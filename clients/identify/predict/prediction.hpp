/// One row of predictions.csv.
#pragma once

#include <cstdint>
#include <string>

namespace kilotwin::identify {

/// Where a robot will be seen, `horizon_s` after all that was used of it.
struct Prediction {
  std::string run;
  std::uint32_t robot;
  double time_s;
  double before_x_mm, before_y_mm;  ///< by the base model
  double after_x_mm, after_y_mm;    ///< by the model with effects
};

}  // namespace kilotwin::identify
