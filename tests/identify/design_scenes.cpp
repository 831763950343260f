#include "tests/identify/design_scenes.hpp"

#include <google/protobuf/text_format.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/model/effect_records.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify::design_scenes {
namespace {

constexpr double kFactor_s = 0.004, kWheel_mm = 0.2, kTracker_mm = 0.8, kTracker_rad = 0.05;
/// Spread of the robots' biases.
constexpr double kBias_mm_s = 1.0;

/// Noise as of real robots (docs/results/identification.md).
constexpr const char* kBase = R"(
motion { straight_speed_mm_s: 10 turn_speed_mm_s: 20 wheel_base_mm: 25 bias_sd_mm_s: 1 factor_variance_s: 0.004 spin_up_s: 0 }
effect { name: "wheel-noise" acts_on: WHEEL_OFFSET function { noise { sd: 0.2 } } }
effect { name: "tracker-x" acts_on: MEASURED_OFFSET function { noise { sd: 0.8 } } }
effect { name: "tracker-y" acts_on: MEASURED_OFFSET direction_deg: 90 function { noise { sd: 0.8 } } }
effect { name: "tracker-heading" acts_on: MEASURED_HEADING function { noise { sd: 0.05 } } }
)";

Factor factor_of(Factor::Shape shape, Covariate of, double high, std::vector<double> points = {}) {
  Factor factor;
  factor.shape = shape;
  factor.axis.of = of;
  factor.low = of == Covariate::kX ? -high : 0;
  factor.high = high;
  factor.points = std::move(points);
  return factor;
}

Term term_of(const char* name, Target target, Factor factor, std::vector<double> coefficients) {
  Term term;
  term.name = name;
  term.blocks = {{target, {{std::move(factor)}}, kDriven}};
  term.coefficients =
      Eigen::Map<const Eigen::VectorXd>(coefficients.data(), static_cast<Eigen::Index>(coefficients.size()));
  // A prior standard deviation of four times the largest coefficient.
  term.precision = Eigen::VectorXd::Constant(term.coefficients.size(),
                                             std::pow(4 * term.coefficients.cwiseAbs().maxCoeff(), -2));
  return term;
}

proto::Model model_with(const Term& term, std::uint32_t robots) {
  proto::Model model;
  if (!google::protobuf::TextFormat::ParseFromString(kBase, &model))
    throw std::logic_error("a scene's model is malformed");
  const Random random(11);
  for (std::uint32_t r = 0; r < robots; ++r) {
    proto::RobotModel& robot = *model.add_robot();
    robot.set_robot(r);
    robot.set_bias_left_mm_s(kBias_mm_s * random.normal(Stream::kWheelBias, r, Tick{0}, 0));
    robot.set_bias_right_mm_s(kBias_mm_s * random.normal(Stream::kWheelBias, r, Tick{0}, 1));
  }
  for (const proto::Effect& effect : effects_of_term(term)) *model.add_effect() = effect;
  return model;
}

/// The first part of a recording, as identify reads it.
MeasuredSet set_of(const RecordingPlan& plan, const PlanTracks& tracks, double until_s) {
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  Run& run = set.runs.emplace_back();
  run.name = "planned";
  for (std::size_t r = 0; r < tracks.size(); ++r) {
    Track& track = run.tracks.emplace_back();
    track.robot = plan.robots[r].robot;
    track.commands.push_back({-1e300, Motion::kStop});
    for (const PlannedCommand& c : plan.robots[r].commands)
      track.commands.push_back({static_cast<double>(c.tick) * kPlanTick_s, c.motion});
    for (const Sample& sample : tracks[r])
      if (sample.time_s <= until_s) track.samples.push_back(sample);
  }
  return set;
}

/// The term with a trend over its covariate: a fit does not know its form.
Term with_trend(Term term) {
  if (term.coefficients.size() != 1) return term;
  Block trend = term.blocks.front();
  Factor line;
  line.axis = trend.basis.factors.front().axis;
  line.low = trend.basis.factors.front().low;
  line.high = trend.basis.factors.front().high;
  trend.basis.factors.push_back(line);
  term.blocks.push_back(std::move(trend));
  const double amplitude = term.coefficients[0];
  term.coefficients = Eigen::Vector2d(amplitude, 0);
  // As in the question of the plan: a standard deviation of half the amplitude, from -1 to 1 over the range.
  term.precision = Eigen::Vector2d(term.precision[0], 1 / (amplitude * amplitude));
  return term;
}

double log_likelihood(const Scene& scene, const MeasuredSet& set, const Term& term) {
  const Fitter fitter(set, 1);
  FitState fit(set);
  fit.model.noise = scene.conditions.noise;
  // From no effect: a fit that starts at the truth would favour it.
  fit.model.terms = {with_trend(term)};
  fit.model.terms.front().coefficients.setZero();
  for (const proto::RobotModel& robot : scene.truths.front().robot()) {
    RobotBias& bias = fit.model.robots[robot.robot()];
    bias.mean_mm_s = {robot.bias_left_mm_s(), robot.bias_right_mm_s()};
    bias.covariance = Eigen::Matrix2d::Identity() * kBias_mm_s * kBias_mm_s;
  }
  fit.tracks.find_headings(fit.model, 1);
  fit.tracks.find_centres(fit.model, 1);
  fitter.fit(fit, 4);
  return fitter.log_likelihood(fit);
}

}  // namespace

std::vector<Pair> pairs() {
  using Shape = Factor::Shape;
  return {
      {"time or driven time",
       term_of("by-time", Target::kGain, factor_of(Shape::kLinear, Covariate::kTime, 100), {-0.06}),
       term_of("by-driving", Target::kGain, factor_of(Shape::kLinear, Covariate::kDrivenTime, 100), {-0.075})},
      {"time since the command or since rest",
       term_of("start", Target::kGain, factor_of(Shape::kExponential, Covariate::kSinceCommand, 100, {4}), {-0.12}),
       term_of("start", Target::kGain, factor_of(Shape::kExponential, Covariate::kSinceRest, 100, {6}), {-0.12})},
      {"place or heading", term_of("east", Target::kGain, factor_of(Shape::kLinear, Covariate::kX, 600), {0.04}),
       term_of("east", Target::kGain, factor_of(Shape::kHarmonics, Covariate::kHeading, 1), {0.015, 0})},
      {"turn rate by the motors' difference or by time",
       term_of("turn", Target::kTurn, factor_of(Shape::kLinear, Covariate::kMotorTimeDifference, 100), {0.03}),
       term_of("turn", Target::kTurn, factor_of(Shape::kLinear, Covariate::kTime, 100), {0.012})}};
}

Scene scene_of(const Pair& pair, std::uint32_t robots, double duration_s) {
  Scene scene{pair, {model_with(pair.first, robots), model_with(pair.other, robots)}, {}, {}, {}};
  RecordingConditions& conditions = scene.conditions;
  conditions.base.bias_sd_mm_s = kBias_mm_s;
  conditions.noise.factor_s = kFactor_s;
  conditions.noise.wheel_mm2_s = kWheel_mm * kWheel_mm;
  conditions.noise.position_mm2 = kTracker_mm * kTracker_mm;
  conditions.noise.heading_rad2 = kTracker_rad * kTracker_rad;
  DesignOptions& options = scene.options;
  options.robots = robots;
  options.duration_s = duration_s;
  options.arena = {1200, 1200};
  scene.question =
      question_of_models({{"first", scene.truths[0]}, {"other", scene.truths[1]}}, {}, duration_s, 600);
  return scene;
}

Decision decide(const Scene& scene, const RecordingPlan& plan, std::size_t truth, std::uint64_t seed) {
  constexpr double kDecided_nat = 3;
  constexpr int kLooks = 12;
  const PlanTracks tracks = play_plan(plan, scene.truths[truth], scene.conditions.every_s, true, seed);
  for (int look = 1; look <= kLooks; ++look) {
    const double at_s = plan.duration_s() * look / kLooks;
    const MeasuredSet set = set_of(plan, tracks, at_s);
    const double ratio =
        log_likelihood(scene, set, scene.pair.first) - log_likelihood(scene, set, scene.pair.other);
    if (std::abs(ratio) >= kDecided_nat) return {at_s, true, (ratio > 0) == (truth == 0)};
  }
  return {plan.duration_s(), false, false};
}

}  // namespace kilotwin::identify::design_scenes
