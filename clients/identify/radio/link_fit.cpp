#include "clients/identify/radio/link_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/pose.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::radio_fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// kilolib's calibration of the low-gain amplifier: exp(-d / 31.2 mm).
constexpr double kDecay_db_per_mm = 0.139;
constexpr double kReference_mm = 132;
constexpr int kRounds = 7, kMostSteps = 12;
/// Beyond this distance hardly any link is on.
constexpr double kFittedTo_mm = 190;
/// From this reception share on, losses are collisions.
constexpr double kOn = 0.6;
/// Wide prior of common parameters, dB.
constexpr double kCommon_sd_db = 6;
/// Prior of the pattern's first harmonic, dB; the n-th has 1/n of it.
constexpr double kPattern_sd_db = 6;

/// A link of a set in one observation.
struct Row {
  std::size_t set;
  int sender, receiver;
  double distance_mm, bearing_rad;  ///< from sender to receiver; all robots face along x
  double bodies, on, runs;
};

/// A random effect of the margins: independent coefficients with one variance. One column of `design` per
/// coefficient.
struct Group {
  MatrixXd design, covariance;  ///< covariance: design design^T
  double sd_db = 0.5;
  bool fixed = false;  ///< the variance is given
};

class Fit {
 public:
  Fit(const std::vector<GridSet>& sets, Terms terms) : sets_(sets), terms_(terms) {
    collect();
    build();
  }
  LinkModel run();

 private:
  void collect();
  void build();
  void add(MatrixXd design, double sd_db, bool fixed = false) {
    MatrixXd covariance = design * design.transpose();
    groups_.push_back({std::move(design), std::move(covariance), sd_db, fixed});
  }
  double find_mode(bool spreads);
  void fit_spreads();
  [[nodiscard]] LinkModel::Swarm swarm_of(std::size_t set, const std::vector<VectorXd>& effects,
                                          std::size_t first) const;
  void add_links(LinkModel&, std::size_t first) const;
  [[nodiscard]] VectorXd variances() const;
  [[nodiscard]] VectorXd offsets() const;

  const std::vector<GridSet>& sets_;
  const Terms terms_;
  std::vector<Row> rows_;
  std::vector<Group> groups_;
  std::vector<double> run_sd_;
  VectorXd dual_, margin_;  ///< margin_ = offsets + covariance * dual_
  VectorXd weight_;         ///< curvature of the likelihood at the mode
};

void Fit::collect() {
  for (std::size_t q = 0; q < sets_.size(); ++q) {
    const MatrixXd on = on_share(sets_[q]);
    for (int j = 0; j < sets_[q].robots(); ++j) {
      for (int i = 0; i < sets_[q].robots(); ++i) {
        if (i == j || on(i, j) < 0) continue;
        const Eigen::Vector2d way = sets_[q].place_mm(i) - sets_[q].place_mm(j);
        if (way.norm() < kFitted_mm || way.norm() > kFittedTo_mm) continue;
        rows_.push_back({q, j, i, way.norm(), std::atan2(way.y(), way.x()), bodies_between(sets_[q], i, j),
                         on(i, j), static_cast<double>(sets_[q].runs.size())});
      }
    }
    run_sd_.push_back(0.7);
  }
}

void Fit::build() {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  const auto each = [&](Eigen::Index columns, auto&& entry) {
    MatrixXd design = MatrixXd::Zero(count, columns);
    for (Eigen::Index r = 0; r < count; ++r) entry(rows_[static_cast<std::size_t>(r)], design.row(r));
    return design;
  };
  add(each(1, [](const Row&, auto row) { row(0) = 1; }), 20 * kCommon_sd_db, true);
  if (terms_ >= Terms::kPattern) {
    add(each(2 * kHarmonics,
             [](const Row& x, auto row) {
               for (int n = 1; n <= kHarmonics; ++n) {
                 row(2 * n - 2) = std::cos(n * x.bearing_rad) / n;
                 row(2 * n - 1) = std::sin(n * x.bearing_rad) / n;
               }
             }),
        kPattern_sd_db, true);
  }
  if (terms_ >= Terms::kPlacement) {
    add(each(2 * kHarmonics * static_cast<Eigen::Index>(sets_.size()),
             [](const Row& x, auto row) {
               const auto first = 2 * kHarmonics * static_cast<Eigen::Index>(x.set);
               for (int n = 1; n <= kHarmonics; ++n) {
                 row(first + 2 * n - 2) = std::cos(n * x.bearing_rad) / n;
                 row(first + 2 * n - 1) = std::sin(n * x.bearing_rad) / n;
               }
             }),
        1.0);
  }
  if (terms_ >= Terms::kBodies)
    add(each(1, [](const Row& x, auto row) { row(0) = -x.bodies; }), kCommon_sd_db, true);
  const int robots = sets_.front().robots();
  const auto all = static_cast<Eigen::Index>(sets_.size()) * robots;
  const auto of = [robots](const Row& x, int robot) { return static_cast<Eigen::Index>(x.set) * robots + robot; };
  if (terms_ >= Terms::kRobots) {
    add(each(all, [&](const Row& x, auto row) { row(of(x, x.sender)) = 1; }), 0.8);
    add(each(all, [&](const Row& x, auto row) { row(of(x, x.receiver)) = 1; }), 0.8);
  }
  if (terms_ >= Terms::kBearings) {
    add(each(2 * all,
             [&](const Row& x, auto row) {
               row(2 * of(x, x.sender)) = std::cos(x.bearing_rad);
               row(2 * of(x, x.sender) + 1) = std::sin(x.bearing_rad);
             }),
        0.5);
    add(each(2 * all,
             [&](const Row& x, auto row) {
               row(2 * of(x, x.receiver)) = -std::cos(x.bearing_rad);
               row(2 * of(x, x.receiver) + 1) = -std::sin(x.bearing_rad);
             }),
        0.5);
  }
  if (terms_ >= Terms::kPairs) {
    add(each(all * robots,
             [&](const Row& x, auto row) {
               row(of(x, std::min(x.sender, x.receiver)) * robots + std::max(x.sender, x.receiver)) = 1;
             }),
        0.5);
    add(MatrixXd::Identity(count, count), 0.5);
  }
  dual_ = VectorXd::Zero(count);
}

VectorXd Fit::offsets() const {
  VectorXd result(static_cast<Eigen::Index>(rows_.size()));
  for (std::size_t r = 0; r < rows_.size(); ++r)
    result(static_cast<Eigen::Index>(r)) = kDecay_db_per_mm * (kReference_mm - rows_[r].distance_mm);
  return result;
}

/// Newton's method for the mode of the margins (Rasmussen and Williams, algorithm 3.1). Returns the log marginal
/// likelihood. `spreads`: also one step of expectation maximisation for the variances.
double Fit::find_mode(bool spreads) {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  MatrixXd covariance = MatrixXd::Zero(count, count);
  for (const Group& group : groups_) covariance += group.sd_db * group.sd_db * group.covariance;
  const VectorXd offset = offsets();
  VectorXd slope(count);
  VectorXd& weight = weight_;
  weight.resize(count);
  Eigen::LLT<MatrixXd> root;
  double likelihood = 0;
  const auto evaluate = [&](const VectorXd& margin) {
    likelihood = 0;
    for (Eigen::Index r = 0; r < count; ++r) {
      const Row& row = rows_[static_cast<std::size_t>(r)];
      const double sd = run_sd_[row.set], z = std::clamp(margin(r) / sd, -6.0, 6.0);
      const double p = stats::normal_cdf(z), density = stats::normal_pdf(z);
      likelihood += row.runs * (row.on * std::log(p) + (1 - row.on) * std::log(1 - p));
      slope(r) = row.runs * density * (row.on - p) / (p * (1 - p)) / sd;
      weight(r) = std::max(row.runs * density * density / (p * (1 - p)) / (sd * sd), 1e-9);
    }
    return likelihood - 0.5 * dual_.dot(margin - offset);
  };
  margin_ = offset + covariance * dual_;
  double best = evaluate(margin_);
  for (int step = 0; step < kMostSteps; ++step) {
    const VectorXd half = weight.cwiseSqrt();
    root.compute(MatrixXd::Identity(count, count) + half.asDiagonal() * covariance * half.asDiagonal());
    const VectorXd right = weight.cwiseProduct(margin_ - offset) + slope;
    const VectorXd full = right - half.cwiseProduct(root.solve(half.cwiseProduct(covariance * right)));
    const VectorXd from = dual_;
    double length = 1, objective = best;
    while (length > 1e-3) {
      dual_ = from + length * (full - from);
      margin_ = offset + covariance * dual_;
      objective = evaluate(margin_);
      if (objective >= best) break;
      length /= 2;
    }
    const double gain = objective - best;
    best = objective;
    if (gain < 1e-2) break;
  }
  const VectorXd half = weight.cwiseSqrt();
  root.compute(MatrixXd::Identity(count, count) + half.asDiagonal() * covariance * half.asDiagonal());
  const double marginal = best - MatrixXd(root.matrixL()).diagonal().array().log().sum();
  if (spreads) {
    const MatrixXd precision = half.asDiagonal() * root.solve(MatrixXd(half.asDiagonal()));
    for (Group& group : groups_) {
      if (group.fixed) continue;
      const double variance = group.sd_db * group.sd_db;
      // Columns without data keep their prior and carry no information.
      const double effects = (group.design.cwiseAbs().colwise().sum().array() > 0).cast<double>().sum();
      const double known = variance * variance * dual_.dot(group.covariance * dual_);
      const double unknown = variance * (effects - variance * group.covariance.cwiseProduct(precision).sum());
      group.sd_db = std::sqrt(std::max((known + unknown) / effects, 1e-4));
    }
  }
  return marginal;
}

/// Posterior variances of the margins, dB^2.
VectorXd Fit::variances() const {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  MatrixXd covariance = MatrixXd::Zero(count, count);
  for (const Group& group : groups_) covariance += group.sd_db * group.sd_db * group.covariance;
  const VectorXd half = weight_.cwiseSqrt();
  const Eigen::LLT<MatrixXd> root(MatrixXd::Identity(count, count) +
                                  half.asDiagonal() * covariance * half.asDiagonal());
  const MatrixXd known = root.matrixL().solve(MatrixXd(half.asDiagonal() * covariance));
  return covariance.diagonal() - known.colwise().squaredNorm().transpose();
}

void Fit::fit_spreads() {
  // Without random effects only the noise of runs needs iterations.
  const int rounds = terms_ >= Terms::kRobots ? kRounds : 3;
  double factor = 1.6;
  for (int round = 0; round < rounds; ++round) {
    find_mode(true);
    if (round % 2 != 0) continue;
    double best = find_mode(false);
    for (double& sd : run_sd_) {
      const double before = sd;
      for (const double tried : {before / factor, before * factor}) {
        sd = tried;
        const double value = find_mode(false);
        if (value > best) {
          best = value;
          break;
        }
        sd = before;
      }
    }
    factor = std::sqrt(factor);
  }
  find_mode(false);
}

/// The robots of a set, from the effects of their groups; `first`: the group of their power.
LinkModel::Swarm Fit::swarm_of(std::size_t set, const std::vector<VectorXd>& effects, std::size_t first) const {
  const Eigen::Index robots = sets_.front().robots(), begin = static_cast<Eigen::Index>(set) * robots;
  LinkModel::Swarm swarm;
  swarm.set = sets_[set].name;
  swarm.run_sd_db = run_sd_[set];
  swarm.power_db = swarm.sensitivity_db = VectorXd::Zero(robots);
  swarm.power_bearing_db = swarm.sensitivity_bearing_db = MatrixXd::Zero(robots, 2);
  swarm.link_db = MatrixXd::Zero(robots, robots);
  swarm.margin_db = MatrixXd::Constant(robots, robots, NAN);
  if (terms_ >= Terms::kRobots) {
    swarm.power_db = effects[first].segment(begin, robots);
    swarm.sensitivity_db = effects[first + 1].segment(begin, robots);
  }
  if (terms_ >= Terms::kBearings) {
    for (Eigen::Index i = 0; i < robots; ++i) {
      swarm.power_bearing_db.row(i) = effects[first + 2].segment(2 * (begin + i), 2).transpose();
      swarm.sensitivity_bearing_db.row(i) = effects[first + 3].segment(2 * (begin + i), 2).transpose();
    }
  }
  return swarm;
}

/// Margins of all links, and the links' own offsets; `first`: the group of pairs.
void Fit::add_links(LinkModel& model, std::size_t first) const {
  const VectorXd variance = variances();
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    LinkModel::Swarm& swarm = model.swarms[row.set];
    const auto at = static_cast<Eigen::Index>(r);
    swarm.margin_db(row.receiver, row.sender) = margin_(at);
    // Uncertainty of a margin moves its probability towards one half: the equivalent margin with the noise of runs
    // only. Between close robots the model's mean is used.
    const double wider = std::sqrt(1 + variance(at) / (swarm.run_sd_db * swarm.run_sd_db));
    const double even = row.distance_mm > kSurelyHeard_mm ? margin_(at) * (1 / wider - 1) : 0;
    if (terms_ >= Terms::kPairs) {
      const Group &pair = groups_[first], &link = groups_[first + 1];
      swarm.link_db(row.receiver, row.sender) = (pair.sd_db * pair.sd_db * pair.covariance.row(at).dot(dual_)) +
                                                link.sd_db * link.sd_db * dual_(at) + even;
    }
  }
}

LinkModel Fit::run() {
  fit_spreads();
  LinkModel model;
  model.terms = terms_;
  std::vector<VectorXd> effects;
  for (const Group& group : groups_)
    effects.push_back(group.sd_db * group.sd_db * (group.design.transpose() * dual_));
  model.range_mm = kReference_mm + effects[0](0) / kDecay_db_per_mm;
  std::size_t next = 1;
  if (terms_ >= Terms::kPattern) {
    model.pattern_db.assign(effects[next].data(), effects[next].data() + effects[next].size());
    for (std::size_t n = 0; n < model.pattern_db.size(); ++n)
      model.pattern_db[n] /= static_cast<double>(harmonic_of(n));
    ++next;
  }
  const std::size_t placement = next;
  if (terms_ >= Terms::kPlacement) model.laying_sd_db = groups_[next++].sd_db;
  if (terms_ >= Terms::kBodies) model.body_loss_db = effects[next++](0);
  for (std::size_t q = 0; q < sets_.size(); ++q) {
    LinkModel::Swarm& swarm = model.swarms.emplace_back(swarm_of(q, effects, next));
    swarm.pattern_db = model.pattern_db;
    for (std::size_t n = 0; n < swarm.pattern_db.size() && terms_ >= Terms::kPlacement; ++n)
      swarm.pattern_db[n] += effects[placement](static_cast<Eigen::Index>(q * swarm.pattern_db.size() + n)) /
                             static_cast<double>(harmonic_of(n));
  }
  add_links(model, next + 4);
  if (terms_ >= Terms::kRobots) {
    model.power_sd_db = groups_[next].sd_db;
    model.sensitivity_sd_db = groups_[next + 1].sd_db;
  }
  if (terms_ >= Terms::kBearings) {
    model.power_bearing_sd_db = groups_[next + 2].sd_db;
    model.sensitivity_bearing_sd_db = groups_[next + 3].sd_db;
  }
  if (terms_ >= Terms::kPairs) {
    model.pair_sd_db = groups_[next + 4].sd_db;
    model.link_sd_db = groups_[next + 5].sd_db;
  }
  return model;
}

}  // namespace

Eigen::MatrixXd on_share(const GridSet& set) {
  const Eigen::Index robots = set.robots();
  // Collision loss of links that are on, taken from links that are always on.
  double heard = 0, near = 0;
  for (const GridRun& run : set.runs) {
    for (int i = 0; i < robots; ++i) {
      for (int j = 0; j < robots; ++j) {
        if (i == j || set.distance_mm(i, j) > kSurelyHeard_mm || run.share(i, j) < 0) continue;
        heard += run.share(i, j);
        near += 1;
      }
    }
  }
  heard = near > 0 && heard > 0 ? heard / near : 1;
  MatrixXd on = MatrixXd::Zero(robots, robots), known = on;
  for (const GridRun& run : set.runs) {
    for (Eigen::Index i = 0; i < robots; ++i) {
      for (Eigen::Index j = 0; j < robots; ++j) {
        const double share = run.share(i, j);
        if (share < 0) continue;
        // A link is on or off; few are received in a part of a run.
        on(i, j) += share >= kOn ? 1 : share / heard;
        known(i, j) += 1;
      }
    }
  }
  for (Eigen::Index n = 0; n < on.size(); ++n) on(n) = known(n) > 0 ? on(n) / known(n) : -1;
  return on;
}

LinkModel fit_links(const std::vector<GridSet>& sets, Terms terms) { return Fit(sets, terms).run(); }

double bodies_between(const GridSet& set, int a, int b) {
  const Eigen::Vector2d from = set.place_mm(a), way = set.place_mm(b) - from;
  double sum = 0;
  for (int k = 0; k < set.robots(); ++k) {
    const Eigen::Vector2d to = set.place_mm(k) - from;
    const double along = to.dot(way) / way.norm(), aside = (to - along * way / way.norm()).norm();
    if (k == a || k == b || along <= 0 || along >= way.norm() || aside >= kRobotRadius_mm) continue;
    sum += std::sqrt(1 - aside * aside / (kRobotRadius_mm * kRobotRadius_mm));
  }
  return sum;
}

proto::Radio LinkModel::population(const Swarm& swarm, const Timing& timing) const {
  proto::Radio radio;
  radio.set_model(proto::Radio::PROPAGATION);
  radio.set_range_mm(range_mm);
  radio.set_oscillator_sd(timing.oscillator_sd);
  proto::Propagation& model = *radio.mutable_propagation();
  model.set_decay_db_per_mm(kDecay_db_per_mm);
  model.set_body_loss_db(std::max(0.0, body_loss_db));
  model.set_power_sd_db(power_sd_db);
  model.set_sensitivity_sd_db(sensitivity_sd_db);
  model.set_power_bearing_sd_db(power_bearing_sd_db);
  model.set_sensitivity_bearing_sd_db(sensitivity_bearing_sd_db);
  model.set_pair_sd_db(pair_sd_db);
  model.set_link_sd_db(link_sd_db);
  model.set_run_sd_db(swarm.run_sd_db);
  model.set_packet_sd_db(timing.packet_sd_db);
  model.set_notice_db(timing.notice_db);
  for (const double entry : swarm.pattern_db) model.add_power_pattern_db(entry);
  return radio;
}

proto::Radio LinkModel::radio(const Swarm& swarm, const Timing& timing) const {
  proto::Radio radio = population(swarm, timing);
  proto::Propagation& model = *radio.mutable_propagation();
  for (Eigen::Index i = 0; i < swarm.power_db.size(); ++i) {
    proto::RobotRadio& robot = *model.add_robot();
    robot.set_robot(static_cast<std::uint32_t>(i));
    robot.set_power_db(swarm.power_db(i));
    robot.set_sensitivity_db(swarm.sensitivity_db(i));
    robot.set_power_ahead_db(swarm.power_bearing_db(i, 0));
    robot.set_power_left_db(swarm.power_bearing_db(i, 1));
    robot.set_sensitivity_ahead_db(swarm.sensitivity_bearing_db(i, 0));
    robot.set_sensitivity_left_db(swarm.sensitivity_bearing_db(i, 1));
    if (timing.oscillator.size() > 0) robot.set_oscillator(timing.oscillator(i));
  }
  for (Eigen::Index i = 0; i < swarm.link_db.rows(); ++i) {
    for (Eigen::Index j = 0; j < swarm.link_db.cols(); ++j) {
      if (i == j || terms < Terms::kPairs) continue;
      proto::RadioLink& link = *model.add_link();
      link.set_sender(static_cast<std::uint32_t>(j));
      link.set_receiver(static_cast<std::uint32_t>(i));
      link.set_offset_db(swarm.link_db(i, j));
    }
  }
  return radio;
}

}  // namespace kilotwin::radio_fit
