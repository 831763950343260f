#include "clients/identify/bristle/identify_bristle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <optional>

#include "clients/identify/bristle/bristle_model.hpp"
#include "clients/identify/bristle/velocity_circle.hpp"
#include "clients/identify/result/values.hpp"
#include "core/base/error.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::bristle {
namespace {

using identify::Identified, identify::Options, identify::Study, identify::json_value;
/// False alarm rate per set.
constexpr double kChance = 0.01;
/// An effect enters the model if its gain exceeds as many standard errors over runs. Then less than 1 in 100 sets has a
/// false alarm, over six tests.
constexpr double kStandardErrors = 3;
constexpr double kPi = 3.14159265358979;
using Places = std::vector<BristleModel::Place>;

/// How an effect is called in result.json.
struct EffectNames {
  const char* name;
  std::array<const char*, 2> covariates;
  const char* acts_on;
};
constexpr std::array<EffectNames, kBristleEffects> kEffects = {
    {{"heading-sense", {"measurement", "heading"}, "MEASURED_HEADING"},
     {"heading-mount", {"measurement", "robot"}, "MEASURED_HEADING"},
     {"front-for-back", {"measurement", "history"}, "MEASURED_HEADING"},
     {"speed-of-run", {"robot", "history"}, "WHEEL_GAIN"},
     {"downhill", {"world_frame", "history"}, "WORLD_DRIFT"},
     {"turning-of-run", {"robot", "history"}, "TURN_RATE"}}};

constexpr std::size_t index_of(BristleEffect effect) { return static_cast<std::size_t>(effect); }

/// Squared errors with sums per run. Runs are independent.
struct Errors {
  std::vector<double> sum, count;

  [[nodiscard]] double mean() const {
    double s = 0, n = 0;
    for (std::size_t r = 0; r < sum.size(); ++r) {
      s += sum[r];
      n += count[r];
    }
    return n > 0 ? s / n : 0;
  }
  /// Standard error over runs of the mean, or of its difference from `other`.
  [[nodiscard]] double error(const Errors* other = nullptr) const {
    double n = 0, spread = 0, runs = 0;
    const double about = other != nullptr ? mean() - other->mean() : mean();
    for (std::size_t r = 0; r < sum.size(); ++r) {
      const double off = sum[r] - (other != nullptr ? other->sum[r] : 0) - about * count[r];
      spread += off * off;
      n += count[r];
      runs += count[r] > 0 ? 1 : 0;
    }
    return runs > 1 ? std::sqrt(spread * runs / (runs - 1)) / n : 0;
  }
};

Errors errors_of(const std::vector<BristleInstant>& instants, const Places& places, std::size_t runs) {
  Errors errors{std::vector<double>(runs, 0), std::vector<double>(runs, 0)};
  for (std::size_t i = 0; i < instants.size(); ++i) {
    const double dx = places[i].x_mm - instants[i].later_x_mm, dy = places[i].y_mm - instants[i].later_y_mm;
    errors.sum[instants[i].run] += dx * dx + dy * dy;
    ++errors.count[instants[i].run];
  }
  return errors;
}

identification::Accuracy accuracy_of(const Errors& errors) {
  const double mean = errors.mean(), half = stats::kNormal95 * errors.error();
  double rows = 0;
  for (const double n : errors.count) rows += n;
  identification::Accuracy out;
  *out.mutable_rmse_mm() = json_value(std::sqrt(mean));
  out.set_rmse_low_mm(std::sqrt(std::max(mean - half, 0.0)));
  out.set_rmse_high_mm(std::sqrt(mean + half));
  out.set_rows(static_cast<std::uint32_t>(rows));
  return out;
}

/// Four-fold cross-validation over the training runs.
class Folds {
 public:
  Folds(const std::vector<BristleInstant>& learned, double horizon_s) : horizon_s_(horizon_s) {
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      std::vector<BristleInstant> rest, own;
      for (const BristleInstant& i : learned) (i.run % kFolds == fold ? own : rest).push_back(i);
      if (rest.empty() || own.empty()) continue;
      models_.emplace_back(rest);
      left_out_.push_back(std::move(own));
    }
  }
  /// Sum of squared errors.
  [[nodiscard]] double error(const BristleEffects& on) const {
    double sum = 0;
    for (std::size_t fold = 0; fold < models_.size(); ++fold) {
      const Places places = models_[fold].predict(left_out_[fold], horizon_s_, on);
      for (std::size_t i = 0; i < places.size(); ++i) {
        const double dx = places[i].x_mm - left_out_[fold][i].later_x_mm,
                     dy = places[i].y_mm - left_out_[fold][i].later_y_mm;
        sum += dx * dx + dy * dy;
      }
    }
    return sum;
  }

 private:
  /// Folds of the runs. More leave more runs to learn from, and cost a model each.
  static constexpr std::size_t kFolds = 4;
  double horizon_s_;
  std::vector<BristleModel> models_;
  std::vector<std::vector<BristleInstant>> left_out_;
};

/// Reference without any model: extrapolation of the last half second.
double extrapolation_rmse_mm(const std::vector<BristleInstant>& instants, double horizon_s) {
  double sum = 0;
  for (const BristleInstant& i : instants) {
    const double dx = i.x_mm + i.vx_mm_s * horizon_s - i.later_x_mm,
                 dy = i.y_mm + i.vy_mm_s * horizon_s - i.later_y_mm;
    sum += dx * dx + dy * dy;
  }
  return instants.empty() ? 0 : std::sqrt(sum / static_cast<double>(instants.size()));
}

std::string words_of(BristleEffect effect, const BristleModel& m) {
  switch (effect) {
    case BristleEffect::kSense:
      return fmt::format(
          "the tracker's headings run clockwise with an offset of {:.2f} rad: alignment with the motion {:.2f}, as "
          "measured {:.2f}",
          m.sense_rad, m.aligned_turned, m.aligned);
    case BristleEffect::kMount: return "the heading offset differs between robots";
    case BristleEffect::kAxis:
      return fmt::format(
          "the tracker sometimes confuses front and back: alignment with the motion {:.2f} for the axis, {:.2f} "
          "for the "
          "heading",
          m.aligned_axis, m.aligned_turned);
    case BristleEffect::kSpeed:
      return fmt::format("the speed differs between runs; median {:.0f} mm/s", m.speed_mm_s);
    case BristleEffect::kDrift: {
      const double size = std::hypot(m.drift_x, m.drift_y),
                   direction = std::atan2(m.drift_y, m.drift_x) * 180 / kPi;
      return fmt::format(
          "robots drift towards {:.0f} degrees by {:.2f} +- {:.2f} of their speed (median of {} runs, standard "
          "deviation "
          "between runs {:.2f})",
          direction, size, stats::kNormal95 * m.drift_se, m.drift_runs, m.drift_sd);
    }
    case BristleEffect::kTurn: return "the turn rate differs between runs";
  }
  return {};
}

google::protobuf::Struct parameters_of(BristleEffect effect, const BristleModel& m) {
  google::protobuf::Struct out;
  const auto put = [&](const char* name, const auto& value) { (*out.mutable_fields())[name] = json_value(value); };
  switch (effect) {
    case BristleEffect::kSense:
      put("form", "linear in the heading");
      put("slope", -2);
      put("at_zero_rad", m.sense_rad);
      return out;
    case BristleEffect::kAxis: put("form", "occasional offset of pi"); return out;
    case BristleEffect::kDrift:
      put("form", "constant times the speed");
      put("x", m.drift_x);
      put("y", m.drift_y);
      put("se", m.drift_se);
      put("sd_between_runs", m.drift_sd);
      return out;
    case BristleEffect::kSpeed: put("median_mm_s", m.speed_mm_s); [[fallthrough]];
    default: put("form", "table by run"); return out;
  }
}

/// Mean speed by direction of motion, minus the run's own: a drift makes one direction faster.
identification::CovariatePlot speed_by_direction(const std::vector<BristleInstant>& instants, const BristleModel& m,
                                                 bool drifting) {
  // Sectors of the plot; more show finer differences, from fewer instants each.
  constexpr std::size_t kSectors = 8;
  std::map<std::size_t, std::vector<std::complex<double>>> ways;
  for (const BristleInstant& i : instants) ways[i.run].emplace_back(i.vx_mm_s, i.vy_mm_s);
  std::array<double, kSectors> before{}, squares{}, after{}, count{};
  for (const auto& [run, of_run] : ways) {
    const VelocityCircle circle = fit_circle(of_run, {m.drift_x, m.drift_y}, 6);
    for (const std::complex<double>& way : of_run) {
      const double part = (std::arg(way) + kPi) / (2 * kPi) * kSectors;
      const std::size_t s = std::min(static_cast<std::size_t>(part), kSectors - 1);
      const double faster = std::abs(way) - circle.speed_mm_s;
      const std::complex<double> own = drifting ? way - circle.drift * circle.speed_mm_s : way;
      before[s] += faster;
      squares[s] += faster * faster;
      after[s] += std::abs(own) - circle.speed_mm_s;
      ++count[s];
    }
  }
  identification::CovariatePlot plot;
  plot.set_target("forward");
  plot.set_covariate("direction of motion");
  plot.set_unit("rad");
  plot.set_acts_on_unit("mm/s");
  for (std::size_t s = 0; s < kSectors; ++s) {
    if (count[s] < 5) continue;
    const double mean = before[s] / count[s];
    plot.add_at((static_cast<double>(s) + 0.5) * 2 * kPi / kSectors - kPi);
    plot.add_before(mean);
    plot.add_before_se(std::sqrt(std::max(squares[s] / count[s] - mean * mean, 0.0) / count[s]));
    plot.add_after(after[s] / count[s]);
  }
  return plot;
}

identification::Table table_of_runs(const google::protobuf::RepeatedPtrField<identification::BristleRun>& runs) {
  identification::Table table;
  table.set_id("runs");
  table.set_title("Runs");
  table.set_lead(
      "Velocities of a run lie on a circle: its radius is the robot's speed, its centre the drift, given relative "
      "to "
      "that speed along x and y. Runs with a single direction use the median drift of the others.");
  identify::assign(table.mutable_head(),
                   std::array{"run", "", "speed, mm/s", "drift along x", "along y", "turn rate, rad/s"});
  for (const identification::BristleRun& run : runs) {
    const double speed = run.speed_mm_s();
    *table.add_rows() = identify::json_list(
        std::array{run.run(), std::string(run.held_out() ? "held out" : "training"), fmt::format("{:.0f}", speed),
                   fmt::format("{:+.2f}", speed > 0 ? run.drift_x_mm_s() / speed : 0),
                   fmt::format("{:+.2f}", speed > 0 ? run.drift_y_mm_s() / speed : 0),
                   fmt::format("{:+.2f}", run.turn_rad_s())});
  }
  return table;
}

/// The model file: the median robot on this table.
proto::Model proto_of(const BristleModel& m, const BristleEffects& on) {
  const auto has = [&](BristleEffect effect) { return on[index_of(effect)]; };
  proto::Model model;
  model.mutable_motion()->set_straight_speed_mm_s(m.speed_mm_s);
  model.mutable_motion()->set_bias_mean_mm_s(0);
  model.mutable_motion()->set_bias_sd_mm_s(0);
  model.mutable_motion()->set_effects_limit_mm_s(effects_limit_mm_s(m.speed_mm_s));
  if (has(BristleEffect::kSense)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name(kEffects[0].name);
    effect.set_acts_on(proto::Effect::MEASURED_HEADING);
    proto::Function& function = *effect.add_function();
    function.set_of(proto::Function::HEADING);
    function.mutable_linear()->set_slope(-2);
    function.mutable_linear()->set_at_zero(m.sense_rad);
  }
  if (has(BristleEffect::kDrift)) {
    proto::Effect& effect = *model.add_effect();
    effect.set_name("downhill");
    effect.set_acts_on(proto::Effect::WORLD_DRIFT);
    effect.set_direction_deg(std::atan2(m.drift_y, m.drift_x) * 180 / kPi);
    effect.add_function()->set_constant(std::hypot(m.drift_x, m.drift_y) * m.speed_mm_s);
  }
  return model;
}

/// One identification, in the order of its public functions.
class BristleStudy final : public Study {
 public:
  BristleStudy(std::vector<BristleRun> train, std::vector<BristleRun> test, Options options)
      : options_(std::move(options)),
        train_(std::move(train)),
        test_(std::move(test)),
        learned_(instants_of(train_, options_.horizon_s)),
        judged_(instants_of(test_, options_.horizon_s)) {
    if (learned_.empty() || judged_.empty())
      throw UserError(
          fmt::format("no run has {:g} s without a gap; give a shorter --horizon", options_.horizon_s + 3));
  }

  void fit() override;
  /// Forward selection, then backward elimination by cross-validation.
  void search() override;
  void judge() override;
  Identified report() override;

 private:
  enum Stage { kSearch, kElimination, kJudgement };
  void begin(Stage) const;
  [[nodiscard]] identification::Result& out() { return *found_.mutable_result(); }
  [[nodiscard]] Errors errors_in(const BristleEffects& on) const {
    return errors_of(learned_, model_.predict(learned_, options_.horizon_s, on), train_.size());
  }
  [[nodiscard]] Errors errors_out(const BristleEffects& on) const {
    return errors_of(judged_, model_.predict(judged_, options_.horizon_s, on), test_.size());
  }
  [[nodiscard]] static BristleEffects with(BristleEffects on, std::size_t effect, bool is) {
    on[effect] = is;
    return on;
  }
  identification::Step& add_step(const char* added, const Errors& errors) {
    identification::Step& step = *found_.add_steps();
    step.set_added(added);
    step.set_rmse_mm(std::sqrt(errors.mean()));
    return step;
  }
  [[nodiscard]] std::optional<std::size_t> best_addition() const;
  [[nodiscard]] bool is_significant(std::size_t effect, const Errors& errors) const;
  void reject(std::size_t effect, const char* why);
  /// Adds the effect with the largest significant reduction of the error on the training runs, until there is none.
  void select();
  void eliminate();
  void add_faults();
  void add_runs();
  void add_horizon();

  const Options options_;
  const std::vector<BristleRun> train_, test_;
  const std::vector<BristleInstant> learned_, judged_;
  BristleModel model_;
  identification::Identification found_;
  BristleEffects on_ = {};
  std::vector<BristleEffect> order_;  ///< of the effects in the model
  Errors now_in_;                     ///< of the model, on the training runs
  Errors before_out_;                 ///< on held-out runs
  Errors now_out_;
};

void BristleStudy::fit() {
  model_ = BristleModel(learned_);
  now_in_ = errors_in({});
  before_out_ = now_out_ = errors_out({});
  add_step("base", now_out_);
}

void BristleStudy::search() {
  select();
  eliminate();
}

bool BristleStudy::is_significant(std::size_t effect, const Errors& errors) const {
  // The test of drift uses velocities, whether or not it improves predictions.
  const bool drifting = effect == index_of(BristleEffect::kDrift) && model_.drift_p < kChance / kBristleEffects &&
                        errors.mean() < now_in_.mean();
  return drifting || now_in_.mean() - errors.mean() >= kStandardErrors * now_in_.error(&errors);
}

std::optional<std::size_t> BristleStudy::best_addition() const {
  std::optional<std::size_t> best;
  double best_mean = 0;
  for (std::size_t e = 0; e < kBristleEffects; ++e) {
    // Mount offset and axis are only defined once the sense of rotation is known.
    const bool waits = !on_[index_of(BristleEffect::kSense)] &&
                       (e == index_of(BristleEffect::kMount) || e == index_of(BristleEffect::kAxis) ||
                        e == index_of(BristleEffect::kDrift));
    if (on_[e] || waits) continue;
    const Errors errors = errors_in(with(on_, e, true));
    if (!is_significant(e, errors) || (best && errors.mean() >= best_mean)) continue;
    best = e;
    best_mean = errors.mean();
  }
  return best;
}

/// Each addition tests all effects that are off, and half of them are expected to be found.
void BristleStudy::begin(Stage stage) const {
  constexpr std::array kNames{"search", "backward elimination", "errors on held-out runs"};
  if (!options_.progress) return;
  const double most = stage == kSearch ? static_cast<double>(kBristleEffects - order_.size()) : 0;
  stats::Work work{kNames[stage], "", stage, 1, {{kSearch, most / 2, most}}};
  for (int later = stage + 1; later <= kJudgement; ++later) work.left.push_back({later, 1, 1});
  options_.progress(work);
}

void BristleStudy::select() {
  begin(kSearch);
  while (const std::optional<std::size_t> best = best_addition()) {
    on_[*best] = true;
    order_.push_back(static_cast<BristleEffect>(*best));
    now_in_ = errors_in(on_);
    const Errors out = errors_out(on_);
    add_step(kEffects[*best].name, out).set_held_out_gain(now_out_.mean() - out.mean());
    now_out_ = out;
    begin(kSearch);
  }
}

void BristleStudy::reject(std::size_t effect, const char* why) {
  identification::Rejected& rejected = *out().add_rejected();
  rejected.set_name(kEffects[effect].name);
  identify::assign(rejected.mutable_covariates(), kEffects[effect].covariates);
  rejected.set_acts_on(kEffects[effect].acts_on);
  rejected.set_why(why);
}

void BristleStudy::eliminate() {
  begin(kElimination);
  const Folds folds(learned_, options_.horizon_s);
  for (std::size_t i = order_.size(); i-- > 0;) {
    const std::size_t e = index_of(order_[i]);
    const BristleEffects without = with(on_, e, false);
    if (folds.error(without) > folds.error(on_)) continue;
    reject(e, "no cross-validated gain on the training runs");
    on_ = without;
    order_.erase(order_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  // The effects together must predict better than none.
  if (!order_.empty() && !(folds.error(on_) < folds.error(BristleEffects{}))) {
    for (const BristleEffect effect : order_)
      reject(index_of(effect), "no cross-validated gain of all effects together on the training runs");
    on_ = {};
    order_.clear();
  }
  now_in_ = errors_in(on_);
  now_out_ = errors_out(on_);
  for (std::size_t e = 0; e < kBristleEffects; ++e) {
    const auto& rejected = out().rejected();
    const bool known =
        std::any_of(rejected.begin(), rejected.end(), [&](const auto& r) { return r.name() == kEffects[e].name; });
    if (!on_[e] && !known) reject(e, "not significant");
  }
}

void BristleStudy::judge() {
  begin(kJudgement);
  *out().mutable_before() = accuracy_of(before_out_);
  *out().mutable_after() = accuracy_of(now_out_);
  const double total = before_out_.mean() - now_out_.mean();
  for (const BristleEffect kind : order_) {
    const std::size_t e = index_of(kind);
    const BristleEffects without = with(on_, e, false);
    const Errors less = errors_out(without), less_in = errors_in(without);
    const double gain = less.mean() - now_out_.mean();
    identification::Effect& effect = *out().add_effects();
    effect.set_name(kEffects[e].name);
    identify::assign(effect.mutable_covariates(), kEffects[e].covariates);
    effect.set_acts_on(kEffects[e].acts_on);
    identification::Evidence& evidence = *effect.mutable_evidence();
    evidence.set_standard_errors((less_in.mean() - now_in_.mean()) / std::max(less_in.error(&now_in_), 1e-12));
    *evidence.mutable_held_out_gain() = json_value(gain);
    *evidence.mutable_held_out_gain_se() = json_value(less.error(&now_out_));
    if (kind == BristleEffect::kDrift) evidence.set_log10_p(std::log10(std::max(model_.drift_p, 1e-300)));
    *effect.mutable_parameters() = parameters_of(kind, model_);
    *effect.mutable_rmse_without_mm() = json_value(std::sqrt(less.mean()));
    *effect.mutable_share_removed() = json_value(total > 0 ? gain / total : 0);
    effect.set_in_words(words_of(kind, model_));
  }
  if (on_[index_of(BristleEffect::kDrift)]) {
    identification::Ambiguous& ambiguous = *out().add_ambiguous();
    ambiguous.set_found("downhill");
    ambiguous.set_instead("a vibration of the table that moves robots");
    ambiguous.set_experiment("rotate the table by 180 degrees, or record with the motors off");
  }
}

void BristleStudy::add_faults() {
  for (const auto* set : {&train_, &test_}) {
    for (const BristleRun& run : *set) {
      if (run.dropped * 50 <= run.size()) continue;
      identification::Fault& fault = *out().add_faults();
      fault.set_kind("jumps");
      fault.set_run(run.name);
      *fault.mutable_robot() = json_value(run.robot);
      fault.set_in_words(fmt::format("{} of {} rows have positions that the robot cannot have reached", run.dropped,
                                     run.dropped + run.size()));
    }
  }
}

void BristleStudy::add_runs() {
  for (const auto* set : {&train_, &test_}) {
    for (const BristleSummary& s : summaries_of(model_, *set, set == &train_ ? learned_ : judged_)) {
      identification::BristleRun& run = *out().add_runs();
      run.set_run(s.run);
      run.set_speed_mm_s(s.speed_mm_s);
      run.set_drift_x_mm_s(s.drift_x_mm_s);
      run.set_drift_y_mm_s(s.drift_y_mm_s);
      run.set_turn_rad_s(s.turn_rad_s);
      run.set_mount_rad(s.mount_rad);
      run.set_held_out(set == &test_);
    }
  }
}

/// Errors over the horizon for the same runs, with the parameters fitted at one horizon.
void BristleStudy::add_horizon() {
  identification::Horizon& horizon = *found_.mutable_horizon();
  for (const double ahead_s : {0.25, 0.5, 1.0, 2.0, 3.0, 5.0}) {
    const std::vector<BristleInstant> instants = instants_of(test_, ahead_s);
    if (instants.empty()) continue;
    const auto rmse = [&](const BristleEffects& with) {
      return std::sqrt(errors_of(instants, model_.predict(instants, ahead_s, with), test_.size()).mean());
    };
    horizon.add_at_s(ahead_s);
    horizon.add_before_mm(rmse(BristleEffects{}));
    horizon.add_after_mm(rmse(on_));
    horizon.add_floor_mm(extrapolation_rmse_mm(instants, ahead_s));
  }
}

Identified BristleStudy::report() {
  out().set_noise_floor_mm(extrapolation_rmse_mm(judged_, options_.horizon_s));
  out().set_noise_floor_how(
      "the error of an extrapolation of the last half second, which needs no model; a model may be better");
  out().set_horizon_s(options_.horizon_s);
  out().mutable_base()->set_straight_speed_mm_s(model_.speed_mm_s);
  add_runs();
  add_faults();
  add_horizon();
  *found_.add_covariate_plots() = speed_by_direction(judged_, model_, on_[index_of(BristleEffect::kDrift)]);
  *found_.add_tables() = table_of_runs(out().runs());
  found_.mutable_set()->set_runs(static_cast<std::uint32_t>(train_.size() + test_.size()));
  found_.mutable_set()->set_has_headings(true);
  found_.mutable_set()->set_has_commands(false);

  Identified identified;
  identified.model = proto_of(model_, on_);
  const Places before = model_.predict(judged_, options_.horizon_s, BristleEffects{}),
               after = model_.predict(judged_, options_.horizon_s, on_);
  for (std::size_t i = 0; i < judged_.size(); ++i) {
    const BristleRun& run = test_[judged_[i].run];
    identified.predictions.push_back(
        {run.name, run.robot, judged_[i].time_s, before[i].x_mm, before[i].y_mm, after[i].x_mm, after[i].y_mm});
  }
  identified.found = std::move(found_);
  return identified;
}

/// Holds out one run in four, and with fewer the last one.
void hold_out(std::vector<BristleRun>& train, std::vector<BristleRun>& test) {
  if (train.size() < 2) throw UserError("one run cannot be held out; give at least two runs, or --test DIR");
  std::vector<BristleRun> kept;
  const std::size_t first = std::min<std::size_t>(3, train.size() - 1);
  for (std::size_t r = 0; r < train.size(); ++r) (r % 4 == first ? test : kept).push_back(std::move(train[r]));
  train = std::move(kept);
}

}  // namespace

std::unique_ptr<Study> bristle_study(std::vector<BristleRun> train, std::vector<BristleRun> test,
                                     const Options& options) {
  if (test.empty()) hold_out(train, test);
  return std::make_unique<BristleStudy>(std::move(train), std::move(test), options);
}

}  // namespace kilotwin::bristle
