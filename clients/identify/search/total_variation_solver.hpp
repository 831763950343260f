/// Solver for a map on a grid under a total variation prior. Its normal equations couple neighbouring nodes only.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace kilotwin::identify {

/// Nodes farther than this from a robot, in cells, do not affect its measurements.
inline constexpr int kReach = 1;
inline constexpr int kAcross = 4 * kReach + 3;  ///< coupled nodes along an axis

/// Equidistant nodes, the first at (x_mm, y_mm).
struct NodeGrid {
  int columns = 0, rows = 0;
  double x_mm = 0, y_mm = 0, pitch_mm = 1;

  [[nodiscard]] std::size_t nodes() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  [[nodiscard]] std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(i);
  }
};

/// Score of all nodes, and information between nodes at most kAcross / 2 apart along each axis.
struct NormalEquations {
  explicit NormalEquations(const NodeGrid& of_grid)
      : grid(of_grid),
        information(of_grid.nodes() * kAcross * kAcross, 0.0F),
        score(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(of_grid.nodes()))) {}

  NodeGrid grid;
  std::vector<float> information;
  Eigen::VectorXd score;

  /// The information row of a node: kAcross * kAcross numbers by rows, the node itself in the middle.
  float* of(int i, int j) { return information.data() + grid.at(i, j) * kAcross * kAcross; }
  /// Adds `factor` times the equations of other data.
  void add(const NormalEquations& other, double factor);
  /// Product of the information matrix with a vector over the nodes.
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd&) const;
};

/// Penalty of a map: weight times the sum over nodes of (|slope|^2 + soft^2)^(power / 2). Power 1 is total
/// variation; a smaller power favours few large steps over many small ones.
struct Variation {
  double weight = 1, soft = 0.01, power = 1;

  /// Weight of a squared slope in the quadratic majoriser at that slope.
  [[nodiscard]] double stiffness(double square) const;
};

/// Rounds of reweighting, and the most steps of conjugate gradients in each.
struct Effort {
  int rounds, steps;
};

/// Maximises score (f - f0) - (f - f0)' information (f - f0) / 2 - penalty(f) with f0 = `from`: iteratively
/// reweighted least squares with conjugate gradients.
[[nodiscard]] Eigen::VectorXd solve(const NormalEquations& data, const Eigen::VectorXd& from, const Variation&,
                                    const Effort&);

}  // namespace kilotwin::identify
