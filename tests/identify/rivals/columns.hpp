/// Inputs of the rivals' regressions.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <vector>

#include "tests/identify/rivals/rates.hpp"

namespace kilotwin::truth {

/// Straight, left, right: a rate belongs to the command under which it occurs.
inline constexpr std::array kMoving = {Motion::kStraight, Motion::kLeft, Motion::kRight};

/// Index into kMoving, or 3 for a robot at rest.
[[nodiscard]] inline std::size_t command_of(const Instant& at) {
  for (std::size_t m = 0; m < kMoving.size(); ++m)
    if (kMoving[m] == at.motion) return m;
  return kMoving.size();
}

/// The mean of a function of instants over the time of each row: one line per row.
template <class Of> Eigen::MatrixXd means(const std::vector<RateRow>& rows, Eigen::Index columns, const Of& of) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), columns);
  Eigen::VectorXd one(columns);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    double span_s = 0;
    for (const Instant& at : rows[r].instants) {
      of(at, one);
      out.row(static_cast<Eigen::Index>(r)) += at.span_s * one.transpose();
      span_s += at.span_s;
    }
    out.row(static_cast<Eigen::Index>(r)) /= span_s;
  }
  return out;
}

[[nodiscard]] inline Eigen::MatrixXd rates_of(const std::vector<RateRow>& rows) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t r = 0; r < rows.size(); ++r) out.row(static_cast<Eigen::Index>(r)) = rows[r].rates.transpose();
  return out;
}

/// Continuous covariates, each about -1..1, for learners without a library of functions.
inline constexpr Eigen::Index kCovariates = 9;
inline void covariates_of(const Instant& at, Eigen::Ref<Eigen::VectorXd> to) {
  to << at.time_s / 100 - 1, at.point.x / 300, at.point.y / 300, std::cos(at.heading_rad), std::sin(at.heading_rad),
      at.driven_s / 100 - 1, 2 * std::exp(-at.since_change_s / 2) - 1,
      at.before == Motion::kStop       ? 1
      : at.before == Motion::kStraight ? 0
                                       : -1,
      std::min(at.near, 3) / 1.5 - 1;
}

/// Speeds and turn rates of every robot under every command: what a base model with biases knows.
[[nodiscard]] inline Eigen::Index base_columns(int robots) { return 3 * (1 + robots); }
inline void base_of(const Instant& at, int robots, Eigen::Ref<Eigen::VectorXd> to) {
  to.setZero();
  const auto command = static_cast<Eigen::Index>(command_of(at));
  if (command == 3) return;
  to[command] = 1;
  to[3 + command * robots + at.robot] = 1;
}

/// Coefficients of these columns alone, by rate.
[[nodiscard]] inline Eigen::MatrixXd base_coefficients(const std::vector<RateRow>& rows, int robots) {
  const Eigen::Index columns = base_columns(robots);
  const Eigen::MatrixXd base =
      means(rows, columns, [&](const Instant& at, Eigen::VectorXd& to) { base_of(at, robots, to); });
  Eigen::MatrixXd xx = base.transpose() * base;
  constexpr double kRidge = 1;  // rows
  xx.diagonal().array() += kRidge;
  return xx.ldlt().solve(base.transpose() * rates_of(rows));
}

/// The speeds straight on, by robot, among coefficients that begin with those of the base columns.
[[nodiscard]] inline Eigen::VectorXd straight_of(const Eigen::MatrixXd& coefficients, int robots) {
  return (coefficients.col(0).segment(3, robots).array() + coefficients(0, 0)).matrix();
}

}  // namespace kilotwin::truth
