#include "clients/identify/design/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/worker_pool.hpp"
#include "core/random/random.hpp"

namespace kilotwin::identify {
namespace {

/// Ends of equal parts of a plan, between which its information is interpolated. More follow it closer, and cost a matrix
/// each.
constexpr std::size_t kCheckpoints = 24;
/// Least distances at the start: of a centre from the wall, and of two centres.
constexpr double kFromWall_mm = 60, kApart_mm = 80;
/// Two robots this near count as in contact: their samples say nothing about the model.
constexpr double kTouching_mm = 40;
/// Seeds of the process noise: of the search, and of the first of the draws that judge.
constexpr std::uint64_t kSearchNoise = 1, kJudgeNoise = 100;
constexpr std::uint64_t kJudgeDraws = 3;

/// Uniform random numbers of one robot's trial.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint32_t robot, std::int64_t trial)
      : random_(seed), robot_(robot), trial_(trial) {}
  double uniform() { return random_.uniform(Stream::kLayout, robot_, Tick{trial_}, draw_++); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform() * static_cast<double>(count)));
  }
  /// An index with probability in proportion to its weight.
  std::size_t weighted(const std::array<double, 4>& weights) {
    double left = uniform() * (weights[0] + weights[1] + weights[2] + weights[3]);
    for (std::size_t i = 0; i < 3; ++i) {
      if (left < weights[i]) return i;
      left -= weights[i];
    }
    return 3;
  }

 private:
  Random random_;
  std::uint32_t robot_;
  std::int64_t trial_;
  std::uint32_t draw_ = 0;
};

/// How a robot is commanded in a trial that starts from nothing.
struct Style {
  std::array<double, 4> weights;  ///< stop, straight, left, right
  double mean_s;                  ///< of a command
};
constexpr Style kRandomStyle = {{1, 2, 1, 1}, 6};
constexpr std::array<Style, 8> kStyles = {{kRandomStyle,
                                           {{1, 2, 1, 1}, 20},
                                           {{0, 1, 0, 0}, 1000},
                                           {{1, 1, 0, 0}, 20},
                                           {{2, 1, 0, 0}, 40},
                                           {{0, 1, 1, 1}, 3},
                                           {{0, 2, 1, 0}, 10},
                                           {{0, 2, 0, 1}, 10}}};

std::int64_t in_steps(double seconds) {
  return std::max<std::int64_t>(1, std::llround(seconds / kPlanTick_s / static_cast<double>(kPlanStep))) *
         kPlanStep;
}

std::vector<PlannedCommand> commands_of(const Style& style, std::int64_t end, Draws& draws) {
  std::vector<PlannedCommand> commands;
  for (std::int64_t tick = kPlanStep; tick < end;) {
    const auto motion = static_cast<Motion>(draws.weighted(style.weights));
    const std::int64_t next = tick + in_steps(-style.mean_s * std::log(draws.uniform()));
    overwrite(commands, tick, std::min(next, end), end, motion);
    tick = next;
  }
  return commands;
}

/// Distance from a place to the nearest other robot's start, of the first `others` robots.
double nearest_mm(const RecordingPlan& plan, std::size_t r, double x_mm, double y_mm,
                  std::size_t others = std::numeric_limits<std::size_t>::max()) {
  double nearest_mm = std::numeric_limits<double>::infinity();
  for (std::size_t o = 0; o < std::min(others, plan.robots.size()); ++o)
    if (o != r)
      nearest_mm = std::min(nearest_mm, std::hypot(plan.robots[o].x_mm - x_mm, plan.robots[o].y_mm - y_mm));
  return nearest_mm;
}

/// Starts the robot somewhere, away from walls and from where the others start.
void place_anywhere(RecordingPlan& plan, std::size_t r, std::size_t others, Draws& draws) {
  const double half_x = std::max(1.0, plan.arena.width_mm / 2 - kFromWall_mm),
               half_y = std::max(1.0, plan.arena.height_mm / 2 - kFromWall_mm);
  PlannedRobot& robot = plan.robots[r];
  double most_mm = -1;
  // Random places, of which the first far enough is taken, or the farthest; more find room among more robots.
  constexpr int kTries = 30;
  for (int n = 0; n < kTries && most_mm < kApart_mm; ++n) {
    const double x = draws.uniform(-half_x, half_x), y = draws.uniform(-half_y, half_y);
    const double at_mm = nearest_mm(plan, r, x, y, others);
    if (at_mm <= most_mm) continue;
    most_mm = at_mm;
    robot.x_mm = x;
    robot.y_mm = y;
  }
  robot.heading_rad = draws.uniform(-M_PI, M_PI);
}

/// Starts the robot beside another one: for effects of neighbours.
void place_beside(RecordingPlan& plan, std::size_t r, Draws& draws) {
  const PlannedRobot& other = plan.robots[(r + 1 + draws.below(plan.robots.size() - 1)) % plan.robots.size()];
  const double half_x = plan.arena.width_mm / 2 - kFromWall_mm, half_y = plan.arena.height_mm / 2 - kFromWall_mm;
  for (int n = 0; n < 10; ++n) {
    const double angle = draws.uniform(-M_PI, M_PI), distance_mm = draws.uniform(45, 140);
    const double x = other.x_mm + distance_mm * std::cos(angle), y = other.y_mm + distance_mm * std::sin(angle);
    if (nearest_mm(plan, r, x, y) < kTouching_mm || std::abs(x) > half_x || std::abs(y) > half_y) continue;
    plan.robots[r].x_mm = x;
    plan.robots[r].y_mm = y;
    return;
  }
}

/// Products of all columns with each other, up to each checkpoint.
using Products = std::vector<Eigen::MatrixXd>;

/// Ends of equal parts of a plan.
std::vector<double> checkpoints_of(const RecordingPlan& plan) {
  std::vector<double> at_s;
  for (std::size_t c = 1; c <= kCheckpoints; ++c)
    at_s.push_back(plan.duration_s() * static_cast<double>(c) / kCheckpoints);
  return at_s;
}

/// Adds `factor` times the products.
void add(Products& to, const Products& more, double factor = 1) {
  to.resize(more.size(), Eigen::MatrixXd::Zero(more.front().rows(), more.front().cols()));
  for (std::size_t c = 0; c < more.size(); ++c) to[c] += factor * more[c];
}

/// Number of rows of samples up to a time.
Eigen::Index rows_until(const std::vector<Sample>& track, double time_s) {
  const auto after =
      std::upper_bound(track.begin(), track.end(), time_s, [](double t, const Sample& s) { return t < s.time_s; });
  return static_cast<Eigen::Index>(after - track.begin()) * kSampleNumbers;
}

/// Predictions of the present model and their derivatives, and what they give.
class Laboratory {
 public:
  Laboratory(const DesignQuestion& question, const RecordingConditions& conditions, std::uint32_t threads)
      : question_(question), conditions_(conditions), threads_(threads), models_{question.present} {
    for (const DesignColumn& column : question.columns) {
      column.change(models_.emplace_back(question.present), column.step);
      coupled_ = coupled_ || couples_robots(models_.back());
    }
  }

  [[nodiscard]] const DesignQuestion& question() const { return question_; }
  [[nodiscard]] bool coupled() const { return coupled_; }
  /// The objective that the search maximises, in nat. `products`: up to each checkpoint.
  [[nodiscard]] double merit(const std::vector<Eigen::MatrixXd>& products) const {
    if (question_.of_parameters()) return information_nat(question_, products.back());
    double sum = 0;
    for (const Eigen::MatrixXd& p : products) sum += std::min(information_nat(question_, p), kDecision_nat);
    return sum / static_cast<double>(products.size());
  }

  /// Tracks of a plan: of the present model, then with a step in each column.
  [[nodiscard]] std::vector<PlanTracks> predict(const RecordingPlan& plan, bool contacts,
                                                std::uint64_t noise) const {
    std::vector<PlanTracks> out(models_.size());
    os::in_parallel(models_.size(), threads_, [&](std::size_t m) {
      out[m] = play_plan(plan, models_[m], conditions_.every_s, contacts, noise);
    });
    return out;
  }
  /// Whitened columns of one robot. `others`: tracks that may come near.
  [[nodiscard]] Eigen::MatrixXd whitened_columns(const RecordingPlan& plan,
                                                 const std::vector<PlanTracks>& predicted, std::size_t r,
                                                 const PlanTracks& others) const {
    const std::vector<Sample>& track = predicted.front()[r];
    Eigen::MatrixXd differences(static_cast<Eigen::Index>(track.size()) * kSampleNumbers,
                                static_cast<Eigen::Index>(question_.columns.size()));
    for (std::size_t c = 0; c < question_.columns.size(); ++c)
      differences.col(static_cast<Eigen::Index>(c)) =
          difference_of(predicted[1 + c][r], track) / question_.columns[c].step;
    return whitened(conditions_, plan.robots[r], track, usable(plan, track, r, others), differences);
  }
  /// Products of the columns of each robot up to each checkpoint.
  [[nodiscard]] std::vector<Products> products(const RecordingPlan& plan, const std::vector<PlanTracks>& predicted,
                                               const PlanTracks& others) const {
    std::vector<Products> out(plan.robots.size());
    const std::vector<double> at_s = checkpoints_of(plan);
    os::in_parallel(out.size(), threads_, [&](std::size_t r) {
      const Eigen::MatrixXd rows = whitened_columns(plan, predicted, r, others);
      const std::vector<Sample>& track = predicted.front()[r];
      Eigen::Index from = 0;
      for (const double t : at_s) {
        const Eigen::Index to = rows_until(track, t);
        const auto part = rows.middleRows(from, to - from);
        out[r].push_back(part.transpose() * part);
        if (out[r].size() > 1) out[r].back() += out[r][out[r].size() - 2];
        from = to;
      }
    });
    return out;
  }

 private:
  /// By sample: whether the robot is away from walls and from other robots.
  [[nodiscard]] static std::vector<bool> usable(const RecordingPlan& plan, const std::vector<Sample>& track,
                                                std::size_t r, const PlanTracks& others) {
    Walls walls;
    walls.x_high_mm = plan.arena.width_mm / 2 - kDiscDiameter_mm / 2;
    walls.y_high_mm = plan.arena.height_mm / 2 - kDiscDiameter_mm / 2;
    walls.x_low_mm = -walls.x_high_mm;
    walls.y_low_mm = -walls.y_high_mm;
    std::vector<bool> out(track.size());
    for (std::size_t k = 0; k < track.size(); ++k) {
      const double x = track[k].x_mm, y = track[k].y_mm;
      out[k] = !walls.at_wall(x, y, kWallMargin_mm);
      for (std::size_t o = 0; o < others.size() && out[k]; ++o)
        out[k] = o == r || std::hypot(others[o][k].x_mm - x, others[o][k].y_mm - y) >= kTouching_mm;
    }
    return out;
  }

  const DesignQuestion& question_;
  const RecordingConditions& conditions_;
  const std::uint32_t threads_;
  std::vector<proto::Model> models_;
  bool coupled_ = false;
};

/// The search for a plan, one sweep after the other.
class Exchange {
 public:
  Exchange(const Laboratory& laboratory, const DesignOptions& options)
      : laboratory_(laboratory), options_(options), plan_(random_plan(options, 0)) {
    std::vector<PlanTracks> predicted = laboratory.predict(plan_, laboratory.coupled(), kSearchNoise);
    products_ = laboratory.products(plan_, predicted, predicted.front());
    tracks_ = std::move(predicted.front());
    total_ = sum_of(products_);
    merit_ = laboratory.merit(total_);
  }

  void sweep(std::uint32_t number) {
    RecordingPlan trial = plan_;
    for (std::size_t r = 0; r < trial.robots.size(); ++r) change(trial, r, number);
    const std::vector<PlanTracks> predicted = laboratory_.predict(trial, laboratory_.coupled(), kSearchNoise);
    const std::vector<Products> products =
        laboratory_.products(trial, predicted, laboratory_.coupled() ? predicted.front() : tracks_);
    if (laboratory_.coupled())
      accept_all(std::move(trial), products, predicted.front());
    else
      accept_each(trial, products, predicted.front());
  }
  [[nodiscard]] const RecordingPlan& plan() const { return plan_; }

 private:
  static Products sum_of(const std::vector<Products>& products) {
    Products sum;
    for (const Products& p : products) add(sum, p);
    return sum;
  }
  /// Another plan of one robot. The first third of the sweeps tries new plans, the others mostly change the present one.
  void change(RecordingPlan& trial, std::size_t r, std::uint32_t number) const {
    Draws draws(options_.seed, trial.robots[r].robot, 1 + number);
    // Robots that influence each other change a few at a time: the plan is kept or dropped as a whole.
    constexpr double kShareOfCoupled = 0.25, kFreshLater = 0.1;
    if (laboratory_.coupled() && draws.uniform() > kShareOfCoupled) return;
    PlannedRobot& robot = trial.robots[r];
    const bool fresh = number < options_.sweeps / 3 || draws.uniform() < kFreshLater;
    const double kind = draws.uniform();
    if (fresh || kind < 0.2) {
      place_anywhere(trial, r, trial.robots.size(), draws);
      if (laboratory_.coupled() && trial.robots.size() > 1 && draws.uniform() < 0.5) place_beside(trial, r, draws);
    }
    if (fresh)
      robot.commands = commands_of(kStyles[draws.below(kStyles.size())], trial.ticks, draws);
    else if (kind >= 0.2)
      overwrite_somewhere(robot, trial.ticks, draws);
  }
  /// One motion in an interval of any length, short ones as likely as long ones.
  static void overwrite_somewhere(PlannedRobot& robot, std::int64_t end, Draws& draws) {
    const std::int64_t steps = end / kPlanStep;
    const auto longest = static_cast<double>(steps - 1);
    const std::int64_t length = std::llround(std::pow(longest, draws.uniform())) * kPlanStep;
    const std::int64_t latest = std::max<std::int64_t>(0, end - kPlanStep - length) / kPlanStep;
    const std::int64_t from =
        kPlanStep * (1 + static_cast<std::int64_t>(draws.below(static_cast<std::size_t>(latest + 1))));
    overwrite(robot.commands, from, std::min(end, from + length), end, static_cast<Motion>(draws.below(4)));
  }
  void accept_all(RecordingPlan trial, const std::vector<Products>& products, const PlanTracks& tracks) {
    const double merit = laboratory_.merit(sum_of(products));
    if (!(merit > merit_)) return;
    plan_ = std::move(trial);
    tracks_ = tracks;
    merit_ = merit;
  }
  void accept_each(const RecordingPlan& trial, const std::vector<Products>& products, const PlanTracks& tracks) {
    for (std::size_t r = 0; r < products.size(); ++r) {
      // The others may have kept their former places.
      if (nearest_mm(plan_, r, trial.robots[r].x_mm, trial.robots[r].y_mm) < kTouching_mm) continue;
      Products total = total_;
      add(total, products_[r], -1);
      add(total, products[r]);
      const double merit = laboratory_.merit(total);
      if (!(merit > merit_)) continue;
      plan_.robots[r] = trial.robots[r];
      products_[r] = products[r];
      tracks_[r] = tracks[r];
      total_ = std::move(total);
      merit_ = merit;
    }
  }

  const Laboratory& laboratory_;
  const DesignOptions& options_;
  RecordingPlan plan_;
  std::vector<Products> products_;  ///< by robot
  PlanTracks tracks_;
  Products total_;
  double merit_ = 0;
};

/// Products of all robots, mean over draws of the process noise.
Products judged(const Laboratory& laboratory, const RecordingPlan& plan) {
  Products sum;
  for (std::uint64_t draw = 0; draw < kJudgeDraws; ++draw) {
    const std::vector<PlanTracks> predicted = laboratory.predict(plan, true, kJudgeNoise + draw);
    for (const Products& of_robot : laboratory.products(plan, predicted, predicted.front()))
      add(sum, of_robot, 1.0 / kJudgeDraws);
  }
  return sum;
}

InformationCurve curve_of(const Laboratory& laboratory, const RecordingPlan& plan) {
  InformationCurve curve;
  curve.at_s = checkpoints_of(plan);
  for (const Eigen::MatrixXd& products : judged(laboratory, plan))
    curve.nat.push_back(information_nat(laboratory.question(), products));
  return curve;
}

/// When a curve has the information; the end if it does not reach it.
double reached_s(const InformationCurve& curve, double nat) {
  return std::min(curve.reaches_s(nat), curve.at_s.back());
}

}  // namespace

double InformationCurve::reaches_s(double nat_needed) const {
  double before_s = 0, before = 0;
  for (std::size_t i = 0; i < nat.size(); ++i) {
    if (nat[i] >= nat_needed)
      return nat[i] > before ? before_s + (at_s[i] - before_s) * (nat_needed - before) / (nat[i] - before)
                             : at_s[i];
    before_s = at_s[i];
    before = nat[i];
  }
  return std::numeric_limits<double>::infinity();
}

double Design::saved() const { return random_s > 0 ? std::max(0.0, 1 - planned_s / random_s) : 0; }

RecordingPlan random_plan(const DesignOptions& options, std::uint32_t number) {
  RecordingPlan plan;
  plan.arena = options.arena;
  plan.ticks = in_steps(options.duration_s);
  plan.robots.resize(options.robots);
  for (std::uint32_t r = 0; r < options.robots; ++r) {
    // Trials of the exchange count up from 1.
    Draws draws(options.seed, r, -1 - static_cast<std::int64_t>(number));
    plan.robots[r].robot = r;
    place_anywhere(plan, r, r, draws);
    if (nearest_mm(plan, r, plan.robots[r].x_mm, plan.robots[r].y_mm, r) < kTouching_mm)
      throw UserError(
          fmt::format("--robots: {} do not fit into {:g} mm by {:g} mm; give fewer, or a larger --arena",
                      options.robots, options.arena.width_mm, options.arena.height_mm));
    plan.robots[r].commands = commands_of(kRandomStyle, plan.ticks, draws);
  }
  return plan;
}

InformationCurve information_of(const RecordingPlan& plan, const DesignQuestion& question,
                                const RecordingConditions& conditions, std::uint32_t threads) {
  return curve_of(Laboratory(question, conditions, threads), plan);
}

Design design_recording(const DesignQuestion& question, const RecordingConditions& conditions,
                        const DesignOptions& options) {
  KILOTWIN_DEMAND(!question.models.empty() && options.robots > 0 && options.random_plans > 0);
  // A sweep tries a change of every robot; the other plans are played once, with contacts.
  enum Kind { kPlay, kSweep };
  const auto begin = [&](Kind kind, std::uint32_t number, const char* stage) {
    if (!options.progress) return;
    const double sweeps = kind == kSweep ? options.sweeps - 1 - number : options.sweeps,
                 plays = kind == kSweep ? 1 : options.random_plans - number;
    const std::uint32_t of = kind == kSweep ? options.sweeps : options.random_plans;
    options.progress({stage,
                      fmt::format("{} of {}", number + 1, of),
                      kind,
                      1,
                      {{kPlay, plays, plays}, {kSweep, sweeps, sweeps}}});
  };
  const Laboratory laboratory(question, conditions, options.threads);
  Design design;
  std::vector<RecordingPlan> random;
  for (std::uint32_t n = 0; n < options.random_plans; ++n) {
    begin(kPlay, n, "random commands");
    random.push_back(random_plan(options, n));
    design.random.push_back(curve_of(laboratory, random.back()));
    design.random_nat += design.random.back().nat.back() / options.random_plans;
  }
  Exchange exchange(laboratory, options);
  for (std::uint32_t s = 0; s < options.sweeps; ++s) {
    begin(kSweep, s, "exchanging commands");
    exchange.sweep(s);
  }
  design.planned = curve_of(laboratory, exchange.plan());
  design.plan = exchange.plan();
  design.needed_nat = question.of_parameters() ? design.random_nat : std::min(design.random_nat, kDecision_nat);
  design.planned_s = reached_s(design.planned, design.needed_nat);
  // Contacts, which the exchange does not play, may cost the plan its advantage.
  for (std::uint32_t n = 0; n < options.random_plans; ++n) {
    const double reached = reached_s(design.random[n], design.needed_nat);
    design.random_s += reached / options.random_plans;
    if (!(reached < design.planned_s)) continue;
    design.planned = design.random[n];
    design.plan = random[n];
    design.planned_s = reached;
  }
  if (question.of_parameters()) design.sd_after = sds_after(question, judged(laboratory, design.plan).back());
  return design;
}

}  // namespace kilotwin::identify
