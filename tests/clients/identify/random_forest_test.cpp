#include "clients/identify/unexplained/random_forest.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace kilotwin::identify {
namespace {

struct Examples {
  Eigen::MatrixXf covariates;
  Eigen::MatrixX2f targets;
};

/// Five uniform covariates in 0..1. The first component steps by 4 at 0.37 of covariate 1, the second one is the product of covariates
/// 0 and 3; both with noise.
Examples examples(Eigen::Index count, unsigned seed, float noise) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform;
  std::normal_distribution<float> normal;
  Examples out{Eigen::MatrixXf::NullaryExpr(count, 5, [&] { return uniform(engine); }), Eigen::MatrixX2f(count, 2)};
  for (Eigen::Index i = 0; i < count; ++i) {
    out.targets(i, 0) = (out.covariates(i, 1) > 0.37F ? 4.0F : 0.0F) + noise * normal(engine);
    out.targets(i, 1) = 8 * out.covariates(i, 0) * out.covariates(i, 3) + noise * normal(engine);
  }
  return out;
}

/// Mean square error of each component, relative to its variance.
Eigen::RowVector2f error_of(const RandomForest& forest, const Examples& judged) {
  const Eigen::MatrixX2f wrong = forest.predict(judged.covariates) - judged.targets;
  const Eigen::MatrixX2f about_mean = judged.targets.rowwise() - judged.targets.colwise().mean();
  return wrong.colwise().squaredNorm().cwiseQuotient(about_mean.colwise().squaredNorm());
}

TEST(RandomForest, LearnsStepsAndProducts) {
  const Examples known = examples(3000, 1, 0.2F), judged = examples(1000, 2, 0);
  const Eigen::RowVector2f error = error_of(RandomForest(known.covariates, known.targets, 2), judged);
  EXPECT_LT(error[0], 0.02F);
  EXPECT_LT(error[1], 0.02F);
}

TEST(RandomForest, PredictsAConstantExactlyAndStaysWithinTheRangeOfTheTargets) {
  Examples known = examples(200, 1, 1);
  const Eigen::MatrixXf far = 100 * examples(50, 2, 1).covariates;
  const Eigen::MatrixX2f seen = RandomForest(known.covariates, known.targets, 2).predict(far);
  for (Eigen::Index c = 0; c < 2; ++c) {
    EXPECT_LE(seen.col(c).maxCoeff(), known.targets.col(c).maxCoeff());
    EXPECT_GE(seen.col(c).minCoeff(), known.targets.col(c).minCoeff());
  }
  known.targets.setConstant(3);
  EXPECT_TRUE(RandomForest(known.covariates, known.targets, 2).predict(far).isConstant(3, 1e-5F));
}

TEST(RandomForest, DoesNotDependOnThreads) {
  const Examples known = examples(500, 1, 1), judged = examples(100, 2, 1);
  const Eigen::MatrixX2f one = RandomForest(known.covariates, known.targets, 1).predict(judged.covariates);
  for (const std::uint32_t threads : {2U, 3U})
    EXPECT_EQ(RandomForest(known.covariates, known.targets, threads).predict(judged.covariates), one);
}

TEST(RandomForest, DoesNotDependOnIncreasingMapsOfCovariates) {
  // Splits lie between the same examples: units and logarithms change nothing.
  Examples known = examples(500, 1, 1);
  const Eigen::MatrixX2f before = RandomForest(known.covariates, known.targets, 2).predict(known.covariates);
  known.covariates = (3 * known.covariates.array()).exp();
  EXPECT_EQ(RandomForest(known.covariates, known.targets, 2).predict(known.covariates), before);
}

TEST(RandomForest, SplitsACovariateOfTwoValues) {
  Examples known = examples(300, 1, 0);
  known.covariates.col(0) = known.covariates.col(0).array().round();
  known.targets.col(0) = 5 * known.covariates.col(0);
  EXPECT_LT(error_of(RandomForest(known.covariates, known.targets, 2), known)[0], 0.01F);
}

TEST(RandomForest, TakesCovariatesThatTellNothing) {
  Examples known = examples(300, 1, 0.2F);
  known.covariates.col(4).setConstant(7);
  known.covariates.col(2) = known.covariates.col(2).array().round();
  const Eigen::RowVector2f error = error_of(RandomForest(known.covariates, known.targets, 2), known);
  EXPECT_LT(error[0], 0.1F);
  // A single example.
  const RandomForest one(known.covariates.topRows(1), known.targets.topRows(1), 2);
  EXPECT_NEAR(one.predict(known.covariates.topRows(1))(0, 0), known.targets(0, 0), 1e-5F);
}

}  // namespace
}  // namespace kilotwin::identify
