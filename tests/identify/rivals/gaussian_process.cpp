// Gaussian-process regression of what the base model's rates leave, with a squared-exponential kernel per command. Random
// Fourier features approximate the kernel: A. Rahimi, B. Recht, Random features for large-scale kernel machines (NIPS 2007).
#include <Eigen/Cholesky>
#include <cmath>
#include <memory>

#include "tests/identify/rivals/columns.hpp"
#include "tests/identify/truth/dice.hpp"

namespace kilotwin::truth {
namespace {

constexpr Eigen::Index kFeatures = 150;

struct Features {
  Eigen::MatrixXd by_covariate{kFeatures, kCovariates};
  Eigen::VectorXd phase{kFeatures};
  int robots;
  double length;
  [[nodiscard]] Eigen::Index columns() const { return base_columns(robots) + 3 * kFeatures; }
  void of(const Instant& at, Eigen::Ref<Eigen::VectorXd> to) const {
    to.setZero();
    base_of(at, robots, to.head(base_columns(robots)));
    const auto command = static_cast<Eigen::Index>(command_of(at));
    if (command == 3) return;
    Eigen::VectorXd z(kCovariates);
    covariates_of(at, z);
    to.segment(base_columns(robots) + command * kFeatures, kFeatures) =
        std::sqrt(2.0 / kFeatures) * (by_covariate * z / length + phase).array().cos();
  }
};

}  // namespace

Rival gaussian_process(const std::vector<RateRow>& rows, int robots) {
  auto features = std::make_shared<Features>();
  features->robots = robots;
  Dice dice(20071203);
  for (Eigen::Index i = 0; i < kFeatures; ++i) {
    features->phase[i] = 2 * M_PI * dice.uniform();
    for (Eigen::Index j = 0; j < kCovariates; ++j) features->by_covariate(i, j) = dice.normal();
  }
  const Eigen::MatrixXd y = rates_of(rows);
  struct Fit {
    double error = INFINITY, length = 1;
    Eigen::MatrixXd coefficients;
  } best;
  // Length scale and signal-to-noise ratio by validation on a fifth of the tracks; then a fit to all.
  for (const double length : {1.0, 2.0, 4.0}) {
    features->length = length;
    const Eigen::MatrixXd x =
        means(rows, features->columns(), [&](const Instant& at, Eigen::VectorXd& to) { features->of(at, to); });
    Eigen::MatrixXd all_xx = Eigen::MatrixXd::Zero(x.cols(), x.cols()), test_xx = all_xx;
    Eigen::MatrixXd all_xy = Eigen::MatrixXd::Zero(x.cols(), 3), test_xy = all_xy;
    Eigen::MatrixXd held(x.rows(), x.cols());
    Eigen::Index n = 0;
    for (Eigen::Index r = 0; r < x.rows(); ++r)
      if (rows[static_cast<std::size_t>(r)].track % 5 == 0) held.row(n++) = x.row(r);
    held.conservativeResize(n, Eigen::NoChange);
    Eigen::MatrixXd held_y(n, 3);
    n = 0;
    for (Eigen::Index r = 0; r < x.rows(); ++r)
      if (rows[static_cast<std::size_t>(r)].track % 5 == 0) held_y.row(n++) = y.row(r);
    test_xx.selfadjointView<Eigen::Lower>().rankUpdate(held.transpose());
    test_xy = held.transpose() * held_y;
    all_xx.selfadjointView<Eigen::Lower>().rankUpdate(x.transpose());
    all_xy = x.transpose() * y;
    for (const double ratio : {0.01, 0.1, 1.0, 10.0}) {
      const auto solved = [&](Eigen::MatrixXd xx, const Eigen::MatrixXd& xy) -> Eigen::MatrixXd {
        xx.diagonal().head(base_columns(robots)).array() += 1;
        xx.diagonal().tail(3 * kFeatures).array() += 1 / ratio;
        return Eigen::LLT<Eigen::MatrixXd, Eigen::Lower>(xx).solve(xy);
      };
      const Eigen::MatrixXd b = solved(all_xx - test_xx, all_xy - test_xy);
      // Rates have different units: errors relative to their variance.
      double error = 0;
      for (int k = 0; k < 3; ++k)
        error += (held_y.col(k) - held * b.col(k)).squaredNorm() / held_y.col(k).squaredNorm();
      if (error >= best.error) continue;
      best = {error, length, solved(all_xx, all_xy)};
    }
  }
  features->length = best.length;
  Rival rival;
  rival.straight_mm_s = straight_of(best.coefficients, robots);
  rival.rates = [features, coefficients = best.coefficients](const Instant& at) -> Eigen::Vector3d {
    Eigen::VectorXd one(features->columns());
    features->of(at, one);
    return coefficients.transpose() * one;
  };
  return rival;
}

}  // namespace kilotwin::truth
