/// Sensitivities of the statistics to the parameters, by fast simulations around the model with common random
/// numbers.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

/// Bounds of a step, in parameter scales: at most `most`, and within each parameter's range.
struct FloorBox {
  std::vector<double> least, most;
};
[[nodiscard]] FloorBox box_around(const FloorModel&, double width, double most);

/// Parameter values `steps` away from the model's, within their ranges.
[[nodiscard]] std::vector<double> moved(const FloorModel&, const std::vector<double>& steps, double width);

/// Fast simulations around a model. They are kept, since earlier ones near the model remain informative.
struct FloorPoints {
  std::vector<std::vector<double>> values;  ///< all parameters
  std::vector<std::size_t> run;             ///< index of the measured run
  std::vector<std::vector<double>> said;    ///< statistics
};
/// Adds `points` simulations within `width` scales of the model, over the runs in turn, up to `longest_s` each.
void add_points(FloorPoints&, const FloorModel&, const FloorTarget&, const std::vector<bool>& moves,
                std::size_t points, double width, double longest_s, std::uint64_t seed);
/// [statistic][parameter], for a step of `width` scales: weighted regression over the simulations; weights fall
/// with the distance.
[[nodiscard]] Eigen::MatrixXd slopes_of(const FloorPoints&, const FloorModel&, const std::vector<bool>& moves,
                                        std::size_t runs, double width);

/// The same from new simulations. Parameters outside `moves` get 0.
[[nodiscard]] Eigen::MatrixXd slopes_around(const FloorModel&, const FloorTarget&, const std::vector<bool>& moves,
                                            double width, double longest_s, std::uint64_t seed);

/// Adds to `slopes` the parameters at 0, each on its own, relative to the model without it, in the same runs.
void add_slopes_of_switches(Eigen::MatrixXd& slopes, const FloorModel&, const FloorTarget&,
                            const std::vector<std::size_t>& switches, double longest_s, std::uint64_t seed);

}  // namespace kilotwin::kilogrid
