/// Values of a term of a fitted model at values of its covariates, with their standard deviations: for every kind of basis.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "clients/identify/fit/uncertainty.hpp"

namespace kilotwin::identify {

/// Where a factor of a block is evaluated.
struct FactorPlace {
  double value = 0, and_value = 0;  ///< of its covariates; kTravelling: the phase in `value`
  bool left_out = false;            ///< a known factor that counts as 1: the block at amplitude 1
};

/// A block of the term, with a place of each of its factors.
struct BlockPlace {
  std::size_t block;
  std::vector<FactorPlace> factors;
};

struct ValueWithSd {
  double value, sd;
};

class TermValues {
 public:
  /// The arguments must outlive the object.
  TermValues(const MotionModel&, const Uncertainty&, std::size_t term);

  /// The sum of these blocks. Its variance is g' C g, with the covariance C of all parameters of the term, held numbers included, and
  /// the derivatives g of the sum.
  [[nodiscard]] ValueWithSd at(const std::vector<BlockPlace>&) const;

 private:
  /// A block of columns that changes the value of a block of the term.
  struct Change {
    std::size_t of;  ///< block of the term
    const Basis* basis;
    Eigen::MatrixXd weights;  ///< columns x held numbers of the term
  };

  const Term& term_;
  std::vector<Eigen::Index> first_;  ///< by block: its first coefficient
  std::vector<Change> changes_;
  Eigen::MatrixXd covariance_;  ///< of the term's coefficients, then of its held numbers
};

}  // namespace kilotwin::identify
