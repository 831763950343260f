// Residuals of known predictions.
#include "clients/identify/report/prediction_residuals.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kilotwin::identify {
namespace {

/// Four robots on straight paths at 10 mm/s in different directions. The `after` predictions are exact; the
/// `before` predictions lag by 4 mm and lie `aside_per_mm` x to the left.
struct Case {
  MeasuredSet set;
  std::vector<Prediction> predictions;

  explicit Case(double aside_per_mm) {
    set.has_commands = true;
    set.runs.push_back({"a", {}});
    for (std::uint32_t robot = 0; robot < 4; ++robot) {
      Track track;
      track.robot = robot;
      track.commands = {{-1e300, Motion::kStop}, {0, Motion::kStraight}};
      const double angle = 1.5 * robot, ux = std::cos(angle), uy = std::sin(angle);
      const auto at = [&](double t, double along, double aside) {
        return Sample{t, (10 * t - 500 + along) * ux - aside * uy + 200.0 * robot,
                      (10 * t - 500 + along) * uy + aside * ux, std::nan("")};
      };
      for (int k = 0; k <= 200; ++k) track.samples.push_back(at(0.5 * k, 0, 0));
      for (int k = 2; k <= 20; ++k) {
        const double t = 5.0 * k;
        const Sample right = at(t, 0, 0), middle = at(t - 5, 0, 0), wrong = at(t, -4, aside_per_mm * middle.x_mm);
        predictions.push_back({"a", robot, t, wrong.x_mm, wrong.y_mm, right.x_mm, right.y_mm});
      }
      set.runs[0].tracks.push_back(std::move(track));
    }
  }
};

const nlohmann::json* plot_over(const nlohmann::json& parts, const std::string& covariate) {
  for (const auto& plot : parts["covariate_plots"]) {
    if (plot["covariate"] == covariate) return &plot;
  }
  return nullptr;
}

TEST(Residuals, PerRobotTheyAreRmsErrors) {
  const Case c(0);
  const auto parts = residual_parts(c.set, c.predictions, 10);
  ASSERT_EQ(parts["robots"].size(), 4U);
  for (const auto& robot : parts["robots"]) {
    EXPECT_NEAR(robot["before_mm"].get<double>(), 4, 1e-9);
    EXPECT_NEAR(robot["after_mm"].get<double>(), 0, 1e-9);
  }
}

TEST(Residuals, CovariatePlotsShowTheDependence) {
  const Case c(0.005);
  const auto parts = residual_parts(c.set, c.predictions, 10);
  const auto* plot = plot_over(parts, "x");
  ASSERT_NE(plot, nullptr);
  // Ahead it is constant, 4 mm; to the left it is -0.005 x.
  for (std::size_t k = 0; k < (*plot)["at"].size(); ++k) {
    const double x = (*plot)["at"][k].get<double>(), residual = (*plot)["before"][k].get<double>();
    EXPECT_NEAR((*plot)["after"][k].get<double>(), 0, 1e-9);
    const bool ahead = (*plot)["target"] == "ahead", left = (*plot)["target"] == "left";
    EXPECT_TRUE(!ahead || std::abs(residual - 4) < 0.8) << residual;
    EXPECT_TRUE(!left || std::abs(residual + 0.005 * x) < 0.5) << residual;
  }
  EXPECT_NE(plot_over(parts, "time"), nullptr);
  EXPECT_NE(plot_over(parts, "driven_time"), nullptr);
  EXPECT_NE(plot_over(parts, "robot"), nullptr);
}

TEST(Residuals, MapsNeedEnoughSamplesPerCell) {
  const Case c(0);
  const auto maps = residual_parts(c.set, c.predictions, 10)["maps"];
  ASSERT_EQ(maps.size(), 2U);
  std::size_t windows = 0;
  for (const auto& map : maps) {
    ASSERT_EQ(map["before"].size(), map["y_mm"].size());
    for (std::size_t r = 0; r < map["before"].size(); ++r) {
      ASSERT_EQ(map["before"][r].size(), map["x_mm"].size());
      for (std::size_t k = 0; k < map["before"][r].size(); ++k) {
        const auto count = map["count"][r][k].get<std::size_t>();
        windows += count;
        EXPECT_EQ(map["before"][r][k].is_null(), count < 3);
        EXPECT_TRUE(count < 3 || std::abs(map["before"][r][k].get<double>()) < 4 + 1e-9);
      }
    }
  }
  EXPECT_EQ(windows, 2 * 4 * 19U);
}

TEST(Residuals, PredictionsWithoutMeasurementAreLeftOut) {
  Case c(0);
  c.set.runs[0].tracks[0].samples.resize(30);
  c.predictions.push_back({"a", 1, 50, std::nan(""), 0, 0, 0});
  c.predictions.push_back({"b", 1, 50, 0, 0, 0, 0});
  c.predictions.push_back({"a", 77, 50, 0, 0, 0, 0});
  const auto parts = residual_parts(c.set, c.predictions, 10);
  for (const auto& robot : parts["robots"]) EXPECT_NEAR(robot["before_mm"].get<double>(), 4, 1e-9);
  EXPECT_EQ(residual_parts({}, {}, 10)["robots"].size(), 0U);
}

}  // namespace
}  // namespace kilotwin::identify
