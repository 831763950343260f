#include "clients/identify/fit/posterior_draws.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <utility>

namespace kilotwin::identify {
namespace {

/// A root of a covariance, which rounding may have left slightly indefinite.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solved(covariance);
  return solved.eigenvectors() * solved.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// Standard normal numbers, alike with every standard library (Box and Muller 1958).
class Normals {
 public:
  Normals(std::uint32_t seed, std::uint32_t number) {
    std::seed_seq both{seed, number};
    random_.seed(both);
  }
  Eigen::VectorXd operator()(Eigen::Index count) {
    Eigen::VectorXd values(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double radius = std::sqrt(-2 * std::log(uniform())), angle = 2 * M_PI * uniform();
      values[i] = radius * std::cos(angle);
    }
    return values;
  }

 private:
  /// In the open interval (0, 1).
  double uniform() { return (static_cast<double>(random_() >> 11) + 0.5) * 0x1p-53; }
  std::mt19937_64 random_;
};

}  // namespace

PosteriorDraws::PosteriorDraws(MotionModel fitted, const Uncertainty& uncertainty)
    : fitted_(std::move(fitted)), root_(root_of(uncertainty.covariance)), given_(uncertainty.given) {}

MotionModel PosteriorDraws::draw(std::uint32_t seed, std::uint32_t number) const {
  Normals normals(seed, number);
  MotionModel model = fitted_;
  const Eigen::VectorXd change = root_ * normals(root_.cols());
  model.base.straight_mm_s += change[kStraightSpeed];
  model.base.turn_mm_s += change[kTurnSpeed];
  model.base.wheel_base_mm += change[kWheelBase];
  model.base.ahead_mm += change[kAheadPoint];
  model.base.left_mm += change[kLeftPoint];
  Eigen::Index first = kBaseColumns;
  for (Term& term : model.terms) {
    term.coefficients += change.segment(first, term.coefficients.size());
    first += term.coefficients.size();
  }
  for (auto& [robot, bias] : model.robots) {
    const auto given = given_.find(robot);
    if (given == given_.end()) continue;
    bias.mean_mm_s += given->second.by_column * change + root_of(given->second.covariance) * normals(2);
  }
  return model;
}

}  // namespace kilotwin::identify
