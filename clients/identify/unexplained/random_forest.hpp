/// A flexible learner: random forests (L. Breiman, 2001) of regression trees.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin::identify {

/// Predicts a vector of two components from covariates, one forest per component.
class RandomForest {
 public:
  /// One row per example, at least one. Equal examples give equal forests, whatever the number of threads.
  RandomForest(const Eigen::MatrixXf& covariates, const Eigen::MatrixX2f& targets, std::uint32_t threads);

  [[nodiscard]] Eigen::MatrixX2f predict(const Eigen::MatrixXf& covariates) const;

 private:
  struct Node {
    std::uint32_t covariate = 0;
    float most = 0;           ///< of that covariate, in the left child: the next node
    std::uint32_t right = 0;  ///< the right child; 0: a leaf
    float mean = 0;           ///< of the targets in a leaf
  };
  using Tree = std::vector<Node>;
  class Grower;

  std::array<std::vector<Tree>, 2> trees_;  ///< by component
};

}  // namespace kilotwin::identify
