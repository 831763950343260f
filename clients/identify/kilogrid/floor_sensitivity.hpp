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

/// What quick runs of models around one said: kept, so that where the search has been counts again as long as it is near.
struct FloorPoints {
  std::vector<std::vector<double>> values;  ///< of all parameters
  std::vector<std::size_t> run;             ///< of the measured ones
  std::vector<std::vector<double>> said;    ///< statistics
};
/// `points` more, within `width` widths of the model, of one run each in turn, not longer than `longest_s`.
void add_points(FloorPoints&, const FloorModel&, const FloorTarget&, const std::vector<bool>& moves,
                std::size_t points, double width, double longest_s, std::uint64_t seed);
/// Per statistic and parameter, of a step of `width` widths: by regression over points, those beyond it by less the farther they are.
[[nodiscard]] Eigen::MatrixXd slopes_of(const FloorPoints&, const FloorModel&, const std::vector<bool>& moves,
                                        std::size_t runs, double width);

/// The same of points of its own. Parameters that `moves` leaves out have slopes of 0.
[[nodiscard]] Eigen::MatrixXd slopes_around(const FloorModel&, const FloorTarget&, const std::vector<bool>& moves,
                                            double width, double longest_s, std::uint64_t seed);

/// Into `slopes`: of parameters that are 0 in the model, each by itself, against none in the same runs.
void add_slopes_of_switches(Eigen::MatrixXd& slopes, const FloorModel&, const FloorTarget&,
                            const std::vector<std::size_t>& switches, double longest_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid
