#include "clients/identify/fit/posterior_draws.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kCoefficients = 3, kColumns = kBaseColumns + kCoefficients;
constexpr std::uint32_t kRobot = 4;

Eigen::MatrixXd some_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
  return matrix;
}

MotionModel some_model() {
  MotionModel model;
  model.robots[kRobot].mean_mm_s = {0.5, -0.25};
  model.robots[9].mean_mm_s = {1, 2};
  model.terms.emplace_back().coefficients = Eigen::Vector3d(3, -2, 1);
  return model;
}

/// A covariance of rank one below full: one coefficient is twice another one.
Uncertainty some_uncertainty() {
  Uncertainty uncertainty;
  Eigen::MatrixXd root = some_matrix(kColumns, kColumns, 1);
  root.row(kColumns - 1) = 2 * root.row(kColumns - 2);
  uncertainty.covariance = root * root.transpose();
  const Eigen::MatrixXd own = some_matrix(2, 2, 2);
  uncertainty.given[kRobot] = {own * own.transpose(), some_matrix(2, kColumns, 3)};
  return uncertainty;
}

Eigen::VectorXd values_of(const MotionModel& model) {
  Eigen::VectorXd values(kColumns + 2);
  values << model.base.straight_mm_s, model.base.turn_mm_s, model.base.wheel_base_mm, model.base.ahead_mm,
      model.base.left_mm, model.terms[0].coefficients, model.robots.at(kRobot).mean_mm_s;
  return values;
}

TEST(PosteriorDraws, HaveTheMeanAndTheCovarianceOfThePosterior) {
  const MotionModel fitted = some_model();
  const Uncertainty uncertainty = some_uncertainty();
  const auto& [own, by] = uncertainty.given.at(kRobot);
  Eigen::MatrixXd expected(kColumns + 2, kColumns + 2);
  expected << uncertainty.covariance, uncertainty.covariance * by.transpose(), by * uncertainty.covariance,
      own + by * uncertainty.covariance * by.transpose();
  const PosteriorDraws posterior(fitted, uncertainty);
  constexpr int kDraws = 20'000;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kColumns + 2);
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(kColumns + 2, kColumns + 2);
  for (std::uint32_t n = 1; n <= kDraws; ++n) {
    const Eigen::VectorXd change = values_of(posterior.draw(1, n)) - values_of(fitted);
    sum += change;
    squares += change * change.transpose();
  }
  // Five standard errors of a mean, and of a covariance of normal numbers.
  for (Eigen::Index i = 0; i < sum.size(); ++i) {
    EXPECT_LT(std::abs(sum[i] / kDraws), 5 * std::sqrt(expected(i, i) / kDraws)) << i;
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double variance = (expected(i, j) * expected(i, j) + expected(i, i) * expected(j, j)) / kDraws;
      EXPECT_LT(std::abs(squares(i, j) / kDraws - expected(i, j)), 5 * std::sqrt(variance)) << i << ", " << j;
    }
  }
}

TEST(PosteriorDraws, AreFunctionsOfSeedAndNumber) {
  const PosteriorDraws posterior(some_model(), some_uncertainty());
  EXPECT_EQ(values_of(posterior.draw(1, 2)), values_of(posterior.draw(1, 2)));
  EXPECT_NE(values_of(posterior.draw(1, 2)), values_of(posterior.draw(1, 3)));
  EXPECT_NE(values_of(posterior.draw(1, 2)), values_of(posterior.draw(2, 2)));
  EXPECT_EQ(posterior.draw(1, 2).robots.at(9).mean_mm_s, some_model().robots.at(9).mean_mm_s)
      << "nothing is known of it";
}

}  // namespace
}  // namespace kilotwin::identify
