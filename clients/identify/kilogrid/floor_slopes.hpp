/// How the statistics of a model of the floor change with its parameters: by quick simulations around it, all with the same random
/// numbers, so that robots differ by the parameter and not by chance.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

/// What steps may be, in widths of the parameters: within `most` and within what each may be.
struct FloorBox {
  std::vector<double> least, most;
};
[[nodiscard]] FloorBox box_around(const FloorModel&, double width, double most);

/// Values `steps` away from those of the model, each within its range.
[[nodiscard]] std::vector<double> moved(const FloorModel&, const std::vector<double>& steps, double width);

/// Per statistic and parameter, of a step of `width` widths: by regression over a design of runs, one of the measured ones at
/// each point in turn, not longer than `longest_s`. Parameters that `moves` leaves out have slopes of 0.
[[nodiscard]] Eigen::MatrixXd slopes_around(const FloorModel&, const FloorTarget&, const std::vector<bool>& moves,
                                            double width, double longest_s, std::uint64_t seed);

/// Into `slopes`: of parameters that are 0 in the model, each by itself, against none in the same runs.
void add_slopes_of_switches(Eigen::MatrixXd& slopes, const FloorModel&, const FloorTarget&,
                            const std::vector<std::size_t>& switches, double longest_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid
