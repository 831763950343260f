#include "clients/identify/radio/evidence.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"
#include "core/stats/resampling.hpp"

namespace kilotwin::radio_fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kShuffles = 100;
/// From this reception share on a link counts as on.
constexpr double kHeard = 0.3;

struct Residuals {
  VectorXd value;
  MatrixXd bearing, placement, bodies, robots, robot_bearings;  ///< regressors
  std::vector<std::pair<int, int>> of;  ///< sender, receiver; robots of all sets are numbered consecutively
};

Residuals residuals(const std::vector<GridSet>& sets, const LinkModel& model) {
  std::vector<double> value;
  Residuals result;
  std::vector<double> angles, bodies;
  std::vector<std::size_t> set_of;
  int first = 0;
  for (std::size_t q = 0; q < sets.size(); ++q) {
    const MatrixXd on = on_share(sets[q]);
    const LinkModel::Swarm& swarm = model.swarms[q];
    for (int j = 0; j < sets[q].robots(); ++j) {
      for (int i = 0; i < sets[q].robots(); ++i) {
        if (i == j || on(i, j) < 0 || std::isnan(swarm.margin_db(i, j))) continue;
        const double expected = stats::normal_cdf(swarm.margin_db(i, j) / swarm.run_sd_db);
        value.push_back(on(i, j) - expected);
        set_of.push_back(q);
        result.of.push_back({first + j, first + i});
        const Eigen::Vector2d way = sets[q].place_mm(i) - sets[q].place_mm(j);
        bodies.push_back(bodies_between(sets[q], i, j));
        angles.push_back(std::atan2(way.y(), way.x()));
      }
    }
    first += sets[q].robots();
  }
  const auto count = static_cast<Eigen::Index>(value.size());
  result.value = Eigen::Map<VectorXd>(value.data(), count);
  result.bearing = MatrixXd::Zero(count, 2 * kHarmonics);
  result.placement = MatrixXd::Zero(count, 2 * kHarmonics * static_cast<Eigen::Index>(sets.size()));
  result.bodies = Eigen::Map<VectorXd>(bodies.data(), count);
  result.bodies.array() -= result.bodies.mean();
  result.robots = MatrixXd::Zero(count, 2 * first);
  result.robot_bearings = MatrixXd::Zero(count, 4 * first);
  for (Eigen::Index r = 0; r < count; ++r) {
    const double angle = angles[static_cast<std::size_t>(r)];
    const auto [sender, receiver] = result.of[static_cast<std::size_t>(r)];
    const auto first_of_set = 2 * kHarmonics * static_cast<Eigen::Index>(set_of[static_cast<std::size_t>(r)]);
    for (int n = 1; n <= kHarmonics; ++n) {
      result.bearing(r, 2 * n - 2) = result.placement(r, first_of_set + 2 * n - 2) = std::cos(n * angle);
      result.bearing(r, 2 * n - 1) = result.placement(r, first_of_set + 2 * n - 1) = std::sin(n * angle);
    }
    result.robots(r, sender) = result.robots(r, first + receiver) = 1;
    result.robot_bearings(r, 2 * sender) = result.robot_bearings(r, 2 * (first + receiver)) = std::cos(angle);
    result.robot_bearings(r, 2 * sender + 1) = result.robot_bearings(r, 2 * (first + receiver) + 1) =
        std::sin(angle);
  }
  return result;
}

/// Share of the variance that a least-squares fit explains, and the same for permuted values.
Evidence explained(std::string what, const MatrixXd& regressors, const VectorXd& value) {
  const VectorXd centred = value.array() - value.mean();
  // A small ridge: regressors may be collinear.
  const MatrixXd normal =
      regressors.transpose() * regressors + 1e-6 * MatrixXd::Identity(regressors.cols(), regressors.cols());
  const Eigen::LDLT<MatrixXd> solver(normal);
  const auto share = [&](const VectorXd& v) {
    const VectorXd fitted = regressors * solver.solve(regressors.transpose() * v);
    return 1 - (v - fitted).squaredNorm() / v.squaredNorm();
  };
  Evidence evidence{std::move(what), share(centred), 0, 0};
  std::mt19937_64 random(1);
  stats::Moments by_chance;
  VectorXd permuted = centred;
  for (int k = 0; k < kShuffles; ++k) {
    stats::permute(
        static_cast<std::size_t>(permuted.size()), [&](std::size_t n) { return random() % n; },
        [&](std::size_t i, std::size_t j) { std::swap(permuted.data()[i], permuted.data()[j]); });
    by_chance.add(share(permuted));
  }
  evidence.by_chance = by_chance.mean();
  evidence.by_chance_sd = by_chance.standard_deviation();
  return evidence;
}

double correlation(const VectorXd& a, const VectorXd& b) {
  const VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  const double norm = x.norm() * y.norm();
  return norm > 0 ? x.dot(y) / norm : 0;
}

}  // namespace

Evidence bearing_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals r = residuals(sets, model);
  return explained("residuals depend on the bearing from sender to receiver, equally in all sets (8 harmonics)",
                   r.bearing, r.value);
}

Evidence placement_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals r = residuals(sets, model);
  return explained("residuals depend on the bearing from sender to receiver, differently per set", r.placement,
                   r.value);
}

Evidence body_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals r = residuals(sets, model);
  return explained("residuals depend on the length of the line covered by other robots", r.bodies, r.value);
}

Evidence robot_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals r = residuals(sets, model);
  return explained("residuals have a component per sender and one per receiver", r.robots, r.value);
}

Evidence robot_bearing_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals r = residuals(sets, model);
  return explained("residuals depend on the bearing, differently per robot", r.robot_bearings, r.value);
}

Evidence pair_evidence(const std::vector<GridSet>& sets, const LinkModel& model) {
  const Residuals a = residuals(half_of(sets, false), model), b = residuals(half_of(sets, true), model);
  Evidence evidence{"residuals of a link repeat between runs (correlation of two halves of the runs)",
                    correlation(a.value, b.value), 0, 1 / std::sqrt(static_cast<double>(a.value.size()))};
  return evidence;
}

Evidence hidden_terminal_evidence(const std::vector<GridSet>& sets) {
  std::vector<double> loss, hidden;
  for (const GridSet& set : sets) {
    const MatrixXd on = on_share(set);
    for (int j = 0; j < set.robots(); ++j) {
      for (int i = 0; i < set.robots(); ++i) {
        if (i == j || set.distance_mm(i, j) > kSurelyHeard_mm) continue;
        double lost = 0, runs = 0, count = 0;
        for (const GridRun& run : set.runs) {
          if (run.share(i, j) < 0) continue;
          lost += 1 - run.share(i, j);
          runs += 1;
        }
        if (!(runs > 0)) continue;
        for (int k = 0; k < set.robots(); ++k) {
          if (k != i && k != j) count += std::max(0.0, on(i, k)) * (1 - std::max(0.0, on(j, k)));
        }
        loss.push_back(lost / runs);
        hidden.push_back(count);
      }
    }
  }
  const auto count = static_cast<Eigen::Index>(loss.size());
  const VectorXd a = Eigen::Map<VectorXd>(loss.data(), count), b = Eigen::Map<VectorXd>(hidden.data(), count);
  return {"loss up to 105 mm depends on the number of hidden robots, received by the receiver only (correlation)",
          correlation(a, b), 0, 1 / std::sqrt(static_cast<double>(count))};
}

Evidence hidden_sender_evidence(const std::vector<GridSet>& sets) {
  std::vector<std::array<double, 5>> rows;
  std::vector<double> loss;
  for (const GridSet& set : sets) {
    const int robots = set.robots();
    const MatrixXd on = on_share(set);
    for (const GridRun& run : set.runs) {
      const auto hears = [&](int i, int j) { return run.share(i, j) > kHeard; };
      for (int j = 0; j < robots; ++j) {
        for (int i = 0; i < robots; ++i) {
          if (i == j || set.distance_mm(i, j) > kSurelyHeard_mm || run.share(i, j) < 0) continue;
          std::array<double, 5> row{1, 0, 0, 0, 0};
          for (int k = 0; k < robots; ++k) {
            if (k == i || k == j || !hears(i, k)) continue;
            if (hears(j, k) || hears(k, j)) {
              row[1] += hears(j, k) && !hears(k, j);
              row[2] += hears(k, j) && !hears(j, k);
            } else {
              row[on(j, k) > 0 || on(k, j) > 0 ? 4 : 3] += 1;
            }
          }
          rows.push_back(row);
          loss.push_back(1 - run.share(i, j));
        }
      }
    }
  }
  MatrixXd x(static_cast<Eigen::Index>(rows.size()), 5);
  for (Eigen::Index r = 0; r < x.rows(); ++r) {
    for (Eigen::Index c = 0; c < 5; ++c) x(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }
  const VectorXd y = Eigen::Map<VectorXd>(loss.data(), x.rows());
  const MatrixXd inverse = (x.transpose() * x + 1e-6 * MatrixXd::Identity(5, 5)).inverse();
  const VectorXd cost = inverse * x.transpose() * y;
  const double variance = (y - x * cost).squaredNorm() / static_cast<double>(x.rows());
  return {
      fmt::format("loss per hidden sender: {:.4f} if it is received in other runs, {:.4f} if never; the difference",
                  cost(4), cost(3)),
      cost(3) - cost(4), 0, std::sqrt(variance * (inverse(3, 3) + inverse(4, 4) - 2 * inverse(3, 4)))};
}

Evidence oscillator_evidence(const std::vector<GridSet>& sets) {
  const bool several = sets.size() > 1 && sets[0].robots() == sets[1].robots();
  const VectorXd a = mean_sent(several ? sets[0] : half_of(sets, false)[0]);
  const VectorXd b = mean_sent(several ? sets[1] : half_of(sets, true)[0]);
  return {std::string("the same robots send less in both ") + (several ? "sets" : "halves of the runs") +
              " (correlation)",
          correlation(a, b), 0, 1 / std::sqrt(static_cast<double>(a.size()))};
}

double same_robots(const LinkModel& model, bool senders) {
  if (model.swarms.size() < 2) return 0;
  const LinkModel::Swarm &a = model.swarms[0], &b = model.swarms[1];
  if (a.power_db.size() != b.power_db.size()) return 0;
  return senders ? correlation(a.power_db, b.power_db) : correlation(a.sensitivity_db, b.sensitivity_db);
}

}  // namespace kilotwin::radio_fit
