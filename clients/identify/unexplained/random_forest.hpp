/// A flexible learner: random forests (L. Breiman, 2001) of regression trees, by OpenCV.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

namespace kilotwin::identify {

/// Predicts a vector of two components from covariates, one forest per component.
class RandomForest {
 public:
  /// One row per example. Equal examples give equal forests, whatever the number of threads.
  RandomForest(const Eigen::MatrixXf& covariates, const Eigen::MatrixX2f& targets, std::uint32_t threads);
  ~RandomForest();
  RandomForest(const RandomForest&) = delete;
  RandomForest& operator=(const RandomForest&) = delete;

  [[nodiscard]] Eigen::MatrixX2f predict(const Eigen::MatrixXf& covariates) const;

 private:
  struct Forests;
  std::unique_ptr<Forests> forests_;
};

}  // namespace kilotwin::identify
