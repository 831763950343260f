// Classifier two-sample test: the area under the ROC curve in closed form, and the power of the classifiers.
#include <gtest/gtest.h>

#include "clients/identify/kilogrid/floor_classifier.hpp"
#include "clients/identify/kilogrid/floor_program.hpp"

namespace kilotwin::kilogrid {
namespace {

TEST(FloorClassifier, TheAreaIsTheShareOfPairsInOrder) {
  EXPECT_EQ(area_under_curve({1, 2, 3}, {4, 5}), 1);
  EXPECT_EQ(area_under_curve({4, 5}, {1, 2, 3}), 0);
  EXPECT_EQ(area_under_curve({1, 3}, {2, 4}), 0.75);
  EXPECT_EQ(area_under_curve({1, 1}, {1}), 0.5);
}

std::vector<TrackWindow> windows(double shift, double product, std::uint64_t seed) {
  Dice dice(seed);
  std::vector<TrackWindow> all;
  for (std::size_t robot = 0; robot < 60; ++robot) {
    for (int w = 0; w < 8; ++w) {
      TrackWindow window{robot, {}};
      for (std::size_t f = 0; f < feature_names().size(); ++f) window.feature.push_back(dice.normal());
      window.feature[2] += shift;
      window.feature[5] += product * window.feature[4] * window.feature[3];
      all.push_back(window);
    }
  }
  return all;
}

TEST(FloorClassifier, IsAtChanceLevelWithoutADifference) {
  const ClassifierResult t = classifier_test(windows(0, 0, 1), windows(0, 0, 2));
  EXPECT_NEAR(t.logistic, 0.5, 0.06);
  EXPECT_NEAR(t.boosted, 0.5, 0.06);
}

TEST(FloorClassifier, DetectsAShiftNearlyOptimally) {
  // Two normal distributions one standard deviation apart: 0.760.
  const ClassifierResult t = classifier_test(windows(0, 0, 3), windows(1, 0, 4));
  EXPECT_NEAR(t.best(), 0.76, 0.06);
  EXPECT_GT(t.logistic, 0.62);  // it estimates 91 terms from few windows
}

TEST(FloorClassifier, DetectsALargerVariance) {
  // Equal means; one feature has a larger variance.
  EXPECT_GT(classifier_test(windows(0, 0, 5), windows(0, 2, 6)).best(), 0.6);
}

}  // namespace
}  // namespace kilotwin::kilogrid
