// Laws of planned recordings: the information of linear cases, the plan of a case whose best plan is known, planted truths.
#include "clients/identify/design/design.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.hpp"
#include "tests/identify/design_scenes.hpp"

namespace kilotwin::identify {
namespace {

RecordingConditions quiet_conditions() {
  RecordingConditions conditions;
  conditions.noise = {};
  conditions.noise.factor_s = conditions.noise.wheel_mm2_s = conditions.noise.heading_rad2_s =
      conditions.noise.drift_mm2_s = 0;
  conditions.noise.position_mm2 = 4;
  conditions.noise.heading_rad2 = 0.01;
  conditions.base.bias_sd_mm_s = 1e-6;
  return conditions;
}

std::vector<Sample> resting(std::size_t samples) {
  std::vector<Sample> track;
  for (std::size_t k = 0; k < samples; ++k) track.push_back({0.5 * static_cast<double>(k), 0, 0, 0});
  return track;
}

/// Sum of (t - mean)^2 over the samples.
double spread_of(const std::vector<Sample>& track) {
  double mean = 0, sum = 0;
  for (const Sample& s : track) mean += s.time_s / static_cast<double>(track.size());
  for (const Sample& s : track) sum += (s.time_s - mean) * (s.time_s - mean);
  return sum;
}

TEST(DesignInformation, OfADriftIsThatOfARegressionLine) {
  const RecordingConditions conditions = quiet_conditions();
  const std::vector<Sample> track = resting(41);
  std::vector<Sample> drifted = track;
  for (Sample& s : drifted) s.x_mm += 3 * s.time_s;
  const Eigen::MatrixXd rows =
      whitened(conditions, {}, track, std::vector<bool>(track.size(), true), difference_of(drifted, track));
  // The start is unknown, so the slope of a line is estimated: the sum of (t - mean)^2 over the variance.
  EXPECT_NEAR(rows.squaredNorm(), 9 * spread_of(track) / 4, 1e-9 * rows.squaredNorm());
}

TEST(DesignInformation, IsHalvedByAContactInTheMiddle) {
  const RecordingConditions conditions = quiet_conditions();
  const std::vector<Sample> track = resting(41);
  std::vector<Sample> drifted = track;
  for (Sample& s : drifted) s.x_mm += s.time_s;
  std::vector<bool> usable(track.size(), true);
  usable[20] = false;
  const double parts = whitened(conditions, {}, track, usable, difference_of(drifted, track)).squaredNorm();
  // Two lines, before and after: samples 0 to 19 and 21 to 40.
  EXPECT_NEAR(parts, 2 * spread_of(resting(20)) / 4, 1e-9 * parts);
}

TEST(DesignInformation, OfASpeedFallsByTheUnknownBias) {
  RecordingConditions conditions = quiet_conditions();
  PlannedRobot robot;
  robot.commands = {{kPlanStep, Motion::kStraight}};
  std::vector<Sample> track = resting(81), faster = track;
  for (std::size_t k = 0; k < track.size(); ++k) {
    const double driven_s = std::max(0.0, track[k].time_s - kPlanStep * kPlanTick_s);
    track[k].x_mm = 10 * driven_s;
    faster[k].x_mm = 11 * driven_s;
  }
  const std::vector<bool> usable(track.size(), true);
  const Eigen::VectorXd d = difference_of(faster, track);
  const double alone = whitened(conditions, robot, track, usable, d).squaredNorm();
  conditions.base.bias_sd_mm_s = 2;
  const double beside_bias = whitened(conditions, robot, track, usable, d).squaredNorm();
  // A common bias of both wheels has the variance s^2 / 2: information I becomes I / (1 + I s^2 / 2).
  EXPECT_NEAR(beside_bias, alone / (1 + alone * 2), 1e-6 * beside_bias);
}

TEST(DesignInformation, OfTwoModelsIsWhatTheFitOfTheOtherLeaves) {
  DesignQuestion question;
  // A speed, and one effect of each model with its amplitude.
  question.columns = {{"speed", 1e6, 1, {}}, {"first", 1e6, 1, {}}, {"other", 1e6, 1, {}}};
  question.models = {{"first", {0, 1}, {1}}, {"other", {0, 2}, {2}}};
  Eigen::MatrixXd rows(4, 3);
  rows << 1, 1, 2,  //
      1, 1, 0,      //
      1, 0, 3,      //
      1, 0, 0;
  // The speed takes the means. Of an effect a, the fitted effect b leaves |a|^2 - (a b)^2 / |b|^2.
  const Eigen::Vector4d a = rows.col(1).array() - rows.col(1).mean(), b = rows.col(2).array() - rows.col(2).mean();
  const double ab = a.dot(b), first = a.squaredNorm() - ab * ab / b.squaredNorm(),
               other = b.squaredNorm() - ab * ab / a.squaredNorm();
  EXPECT_NEAR(information_nat(question, rows.transpose() * rows), 0.5 * std::min(first, other), 1e-6);
}

TEST(DesignInformation, OfParametersIsTheGrowthOfTheLogDeterminant) {
  DesignQuestion question;
  question.columns = {{"a", 0.5, 1, {}}, {"b", 2, 1, {}}};
  question.models = {{"present", {0, 1}, {}}};
  Eigen::Matrix2d products;
  products << 12, 0, 0, 0.75;
  EXPECT_NEAR(information_nat(question, products), 0.5 * std::log(16.0 / 4 * 1.0 / 0.25), 1e-12);
  EXPECT_NEAR(sds_after(question, products)[0], 0.25, 1e-12);
}

/// One unknown number of the base model.
DesignQuestion question_of(const std::string& name) {
  proto::Model model;
  model.mutable_motion()->set_bias_mean_mm_s(0);
  model.mutable_motion()->set_bias_sd_mm_s(0);
  DesignQuestion question = question_of_parameters(model, {});
  std::erase_if(question.columns, [&](const DesignColumn& c) { return c.name != name; });
  question.models.front().fitted = {0};
  return question;
}

double share_of(const RecordingPlan& plan, Motion motion) {
  std::int64_t ticks = 0;
  for (const PlannedRobot& robot : plan.robots)
    for (std::size_t c = 0; c < robot.commands.size(); ++c) {
      const std::int64_t end = c + 1 < robot.commands.size() ? robot.commands[c + 1].tick : plan.ticks;
      if (robot.commands[c].motion == motion) ticks += end - robot.commands[c].tick;
    }
  return static_cast<double>(ticks) / static_cast<double>(plan.ticks - kPlanStep) /
         static_cast<double>(plan.robots.size());
}

TEST(DesignPlan, OfOneSpeedDrivesAtThatSpeedAllTheTime) {
  DesignOptions options;
  options.robots = 3;
  options.duration_s = 40;
  options.arena = {4000, 4000};
  options.sweeps = 200;
  options.random_plans = 3;
  const RecordingConditions conditions = quiet_conditions();
  const Design straight = design_recording(question_of("straight speed, mm/s"), conditions, options);
  EXPECT_GT(share_of(straight.plan, Motion::kStraight), 0.9);
  RecordingPlan known = straight.plan;
  for (PlannedRobot& robot : known.robots) robot.commands = {{kPlanStep, Motion::kStraight}};
  const double best = information_of(known, question_of("straight speed, mm/s"), conditions, 2).nat.back();
  EXPECT_NEAR(straight.planned.nat.back(), best, 0.03) << "within 6 % of the information of the known plan";
  EXPECT_GT(straight.saved(), 0.2);
}

TEST(DesignPlan, IsTheSameForAnyNumberOfThreads) {
  design_scenes::Scene scene = design_scenes::scene_of(design_scenes::pairs().front(), 2, 30);
  scene.options.sweeps = 6;
  scene.options.random_plans = 2;
  scene.options.threads = 1;
  const std::string one = commands_csv(design_recording(scene.question, scene.conditions, scene.options).plan, "r");
  scene.options.threads = 3;
  EXPECT_EQ(commands_csv(design_recording(scene.question, scene.conditions, scene.options).plan, "r"), one);
}

TEST(DesignPlan, DecidesForThePlantedTruthInFewerRobotMinutesThanRandomCommands) {
  design_scenes::Scene scene = design_scenes::scene_of(design_scenes::pairs().front(), 3, 240);
  scene.options.sweeps = 100;
  scene.options.random_plans = 2;
  const Design design = design_recording(scene.question, scene.conditions, scene.options);
  EXPECT_GT(design.saved(), 0.2) << "expected";
  double random_s = 0, planned_s = 0;
  int right = 0;
  for (std::uint32_t n = 0; n < 3; ++n) {
    for (const std::size_t truth : {std::size_t{0}, std::size_t{1}}) {
      random_s += decide(scene, random_plan(scene.options, 100 + n), truth, 7 + n).after_s;
      const design_scenes::Decision decision = decide(scene, design.plan, truth, 7 + n);
      planned_s += decision.after_s;
      right += decision.right ? 1 : 0;
    }
  }
  EXPECT_GE(right, 5) << "of 6 recordings";
  EXPECT_LT(planned_s, 0.8 * random_s) << planned_s / 6 << " s beside " << random_s / 6 << " s";
}

TEST(DesignPlan, RefusesModelsThatPredictTheSame) {
  const proto::Model model = design_scenes::scene_of(design_scenes::pairs().front(), 2, 30).truths[0];
  EXPECT_THROW((void)question_of_models({{"a", model}, {"b", model}}, {}, 60, 500), UserError);
}

TEST(RecordingPlanTest, OverwritesAnIntervalAndContinuesAfterIt) {
  std::vector<PlannedCommand> commands;
  const auto text = [&] {
    std::string out;
    for (const PlannedCommand& c : commands) out += std::to_string(c.tick / kPlanStep) + name_of(c.motion)[1];
    return out;
  };
  constexpr std::int64_t kEnd = 20 * kPlanStep;
  overwrite(commands, 1 * kPlanStep, kEnd, kEnd, Motion::kStraight);
  EXPECT_EQ(text(), "1t");
  overwrite(commands, 5 * kPlanStep, 8 * kPlanStep, kEnd, Motion::kLeft);
  EXPECT_EQ(text(), "1t5e8t");
  overwrite(commands, 3 * kPlanStep, 6 * kPlanStep, kEnd, Motion::kStraight);
  EXPECT_EQ(text(), "1t6e8t");
  overwrite(commands, 2 * kPlanStep, 19 * kPlanStep, kEnd, Motion::kRight);
  EXPECT_EQ(text(), "1t2i19t");
  overwrite(commands, 1 * kPlanStep, kEnd, kEnd, Motion::kStop);
  EXPECT_EQ(text(), "");
}

}  // namespace
}  // namespace kilotwin::identify
