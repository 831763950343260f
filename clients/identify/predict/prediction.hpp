/// One row of predictions.csv.
#pragma once

#include <cstdint>
#include <string>

namespace kilotwin::identify {

/// The predicted position of a robot at time_s, one horizon after the last measurement used.
struct Prediction {
  std::string run;
  std::uint32_t robot;
  double time_s;
  double before_x_mm, before_y_mm;  ///< base model
  double after_x_mm, after_y_mm;    ///< model with effects
};

}  // namespace kilotwin::identify
