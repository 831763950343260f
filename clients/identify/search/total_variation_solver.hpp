/// Solves for a map over the plane given at the nodes of a fine grid: normal equations that join each node with those around it,
/// edges kept sharp.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace kilotwin::identify {

/// Nodes farther than this from where a robot is do not matter any more to what is seen of it, in cells.
inline constexpr int kReach = 1;
inline constexpr int kAcross = 4 * kReach + 3;  ///< nodes that have to do with one, along an axis

/// Nodes at equal distances along x and y, the first at (x_mm, y_mm).
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

/// Information and score of the values at all nodes: of each node with those at most kAcross / 2 nodes away along each axis.
struct NormalEquations {
  explicit NormalEquations(const NodeGrid& of_grid)
      : grid(of_grid),
        information(of_grid.nodes() * kAcross * kAcross, 0.0F),
        score(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(of_grid.nodes()))) {}

  NodeGrid grid;
  std::vector<float> information;
  Eigen::VectorXd score;

  /// The information of a node with those around it, kAcross * kAcross numbers by rows, itself in the middle.
  float* of(int i, int j) { return information.data() + grid.at(i, j) * kAcross * kAcross; }
  /// Adds those of other data, or with a factor of -1 takes them off.
  void add(const NormalEquations& other, double factor);
  /// The information times a vector over the nodes.
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd&) const;
};

/// What is held against a map beforehand: in proportion to weight, the sum over nodes of (|slope|^2 + soft^2)^(power / 2). With a
/// power of 1 that is its total variation; with a smaller one few large steps cost less than many small ones.
struct Variation {
  double weight = 1, soft = 0.01, power = 1;

  /// Of the square of a slope in the quadratic form that touches the sum there.
  [[nodiscard]] double stiffness(double square) const;
};

/// Rounds of weighing slopes anew, and at most so many steps of conjugate gradients in each.
struct Effort {
  int rounds, steps;
};

/// The map f that maximises score (f - f0) - (f - f0) information (f - f0) / 2 less the variation, f0 being `from`: weights of
/// slopes in turn with conjugate gradients.
[[nodiscard]] Eigen::VectorXd solve(const NormalEquations& data, const Eigen::VectorXd& from, const Variation&,
                                    const Effort&);

}  // namespace kilotwin::identify
