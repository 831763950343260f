#include "clients/identify/search/total_variation_solver.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {

double Variation::stiffness(double square) const {
  constexpr double kUsual = 0.03;  // slope between nodes at which all powers have the same penalty
  return weight / kUsual * std::pow((square + soft * soft) / (kUsual * kUsual), power / 2 - 1);
}

void NormalEquations::add(const NormalEquations& other, double factor) {
  for (std::size_t k = 0; k < information.size(); ++k)
    information[k] += static_cast<float>(factor) * other.information[k];
  score += factor * other.score;
}

Eigen::VectorXd NormalEquations::times(const Eigen::VectorXd& v) const {
  constexpr int kHalf = kAcross / 2;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(v.size());
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      const float* const own = information.data() + grid.at(i, j) * kAcross * kAcross;
      if (own[kHalf * kAcross + kHalf] == 0) continue;
      double sum = 0;
      const int left = std::max(-kHalf, -i), right = std::min(kHalf, grid.columns - 1 - i);
      for (int dj = std::max(-kHalf, -j); dj <= std::min(kHalf, grid.rows - 1 - j); ++dj) {
        const float* const by = own + (dj + kHalf) * kAcross + kHalf;
        const double* const from = v.data() + static_cast<std::ptrdiff_t>(grid.at(i, j + dj));
        for (int di = left; di <= right; ++di) sum += by[di] * from[di];
      }
      out[static_cast<Eigen::Index>(grid.at(i, j))] = sum;
    }
  }
  return out;
}

Eigen::VectorXd solve(const NormalEquations& data, const Eigen::VectorXd& from, const Variation& by,
                      const Effort& effort) {
  Eigen::VectorXd f = from;
  const NodeGrid& g = data.grid;
  const Eigen::VectorXd right = data.times(from) + data.score;
  Eigen::VectorXd diagonal(f.size());
  constexpr std::size_t kMiddle = (kAcross / 2) * kAcross + kAcross / 2;
  for (std::size_t n = 0; n < g.nodes(); ++n)
    diagonal[static_cast<Eigen::Index>(n)] = data.information[n * kAcross * kAcross + kMiddle];
  const auto at = [&](int i, int j) { return static_cast<Eigen::Index>(g.at(i, j)); };
  Eigen::VectorXd weights(f.size());
  for (int round = 0; round < effort.rounds; ++round) {
    for (int j = 0; j < g.rows; ++j) {
      for (int i = 0; i < g.columns; ++i) {
        const double x = i + 1 < g.columns ? f[at(i + 1, j)] - f[at(i, j)] : 0,
                     y = j + 1 < g.rows ? f[at(i, j + 1)] - f[at(i, j)] : 0;
        weights[at(i, j)] = by.stiffness(x * x + y * y);
      }
    }
    const auto times = [&](const Eigen::VectorXd& v) {
      Eigen::VectorXd out = data.times(v);
      for (int j = 0; j < g.rows; ++j) {
        for (int i = 0; i < g.columns; ++i) {
          const Eigen::Index n = at(i, j);
          for (const Eigen::Index m : {i + 1 < g.columns ? at(i + 1, j) : n, j + 1 < g.rows ? at(i, j + 1) : n}) {
            const double flow = weights[n] * (v[m] - v[n]);
            out[m] += flow;
            out[n] -= flow;
          }
        }
      }
      return out;
    };
    Eigen::VectorXd preconditioner = diagonal;
    for (int j = 0; j < g.rows; ++j) {
      for (int i = 0; i < g.columns; ++i) {
        const Eigen::Index n = at(i, j);
        for (const Eigen::Index m : {i + 1 < g.columns ? at(i + 1, j) : n, j + 1 < g.rows ? at(i, j + 1) : n}) {
          if (m == n) continue;
          preconditioner[n] += weights[n];
          preconditioner[m] += weights[n];
        }
      }
    }
    Eigen::VectorXd rest = right - times(f);
    Eigen::VectorXd direction = rest.cwiseQuotient(preconditioner);
    double size = rest.dot(direction);
    const double enough = 1e-6 * size;
    for (int step = 0; step < effort.steps && size > enough && size > 1e-12; ++step) {
      const Eigen::VectorXd image = times(direction);
      const double along = direction.dot(image);
      if (!(along > 0)) break;
      const double length = size / along;
      f += length * direction;
      rest -= length * image;
      const Eigen::VectorXd next = rest.cwiseQuotient(preconditioner);
      const double next_size = rest.dot(next);
      direction = next + next_size / size * direction;
      size = next_size;
    }
  }
  return f;
}

}  // namespace kilotwin::identify
