#include "clients/identify/design/innovations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

/// x, y of the tracked point, heading, bias of the left and the right wheel.
constexpr Eigen::Index kStates = 5;
using StateMatrix = Eigen::Matrix<double, kStates, kStates>;

/// A person who places robots by hand errs by this in the heading. rad
constexpr double kPlacedHeading_rad = 0.3;

/// Between two samples: how long the robot drove, and how fast the wheels were.
struct Drive {
  double driven_s = 0;
  /// Integrals over the driven time: squared nominal speeds of the wheels, mm^2/s.
  double left_mm2_s = 0, right_mm2_s = 0;
};

Drive drive_between(const RecordingConditions& conditions, const PlannedRobot& robot, double from_s, double to_s) {
  Drive drive;
  for (std::size_t i = 0; i < robot.commands.size(); ++i) {
    const double begins_s = static_cast<double>(robot.commands[i].tick) * kPlanTick_s;
    const double ends_s =
        i + 1 < robot.commands.size() ? static_cast<double>(robot.commands[i + 1].tick) * kPlanTick_s : to_s;
    const double lasts_s = std::min(ends_s, to_s) - std::max(begins_s, from_s);
    if (lasts_s <= 0 || robot.commands[i].motion == Motion::kStop) continue;
    const Eigen::Vector2d speed = nominal_speeds(conditions.base, robot.commands[i].motion);
    drive.driven_s += lasts_s;
    drive.left_mm2_s += lasts_s * speed[0] * speed[0];
    drive.right_mm2_s += lasts_s * speed[1] * speed[1];
  }
  return drive;
}

/// The filter of one track. It is linear: covariances and gains are those of the predicted track.
class Whitener {
 public:
  Whitener(const RecordingConditions& conditions, const PlannedRobot& robot, const std::vector<Sample>& track,
           const Eigen::MatrixXd& differences)
      : conditions_(conditions), robot_(robot), track_(track), differences_(differences) {
    const double sd = conditions.base.bias_sd_mm_s;
    bias_ = Eigen::Matrix2d::Identity() * sd * sd;
    if (const auto known = conditions.bias_covariance.find(robot.robot); known != conditions.bias_covariance.end())
      bias_ = known->second;
    states_.setZero(kStates, differences.cols());
    covariance_.setZero();
    covariance_.bottomRightCorner<2, 2>() = bias_;
    covariance_(2, 2) =
        conditions.headings ? conditions.noise.heading_rad2 : kPlacedHeading_rad * kPlacedHeading_rad;
    place(0);
    if (conditions.headings) states_.row(2) = differences_.row(2);
  }

  /// The position as measured at a sample, whatever came before.
  void place(std::size_t k) {
    covariance_.topRows<2>().setZero();
    covariance_.leftCols<2>().setZero();
    covariance_(0, 0) = covariance_(1, 1) = conditions_.noise.position_mm2;
    states_.topRows<2>() = differences_.middleRows(row_of(k), 2);
  }
  /// From sample k - 1 to sample k.
  void predict(std::size_t k, bool in_contact) {
    const Sample &a = track_[k - 1], &b = track_[k];
    const double h_s = b.time_s - a.time_s, dx = b.x_mm - a.x_mm, dy = b.y_mm - a.y_mm;
    const Drive drive = drive_between(conditions_, robot_, a.time_s, b.time_s);
    const double middle = a.heading_rad + wrapped_angle(b.heading_rad - a.heading_rad) / 2;
    const double c = std::cos(middle), s = std::sin(middle), base_mm = conditions_.base.wheel_base_mm;
    // A path of one mm of a wheel turns the robot about the reference point, which is behind the tracked point. In the mean it
    // does so in the middle of the interval.
    const double turn = 1 / base_mm, ahead_mm = conditions_.base.ahead_mm;
    const Eigen::Vector3d rotation(-ahead_mm * s - dy / 2, ahead_mm * c + dx / 2, 1);
    Eigen::Matrix<double, 3, 2> by_path;
    by_path.col(0) = Eigen::Vector3d(c / 2, s / 2, 0) - turn * rotation;
    by_path.col(1) = Eigen::Vector3d(c / 2, s / 2, 0) + turn * rotation;

    StateMatrix step = StateMatrix::Identity();
    step(0, 2) = -dy;
    step(1, 2) = dx;
    step.topRightCorner<3, 2>() = drive.driven_s * by_path;
    states_ = (step * states_).eval();
    covariance_ = step * covariance_ * step.transpose();

    const Noise& noise = conditions_.noise;
    const Eigen::Vector2d path(noise.factor_s * drive.left_mm2_s + noise.wheel_mm2_s * drive.driven_s,
                               noise.factor_s * drive.right_mm2_s + noise.wheel_mm2_s * drive.driven_s);
    covariance_.topLeftCorner<3, 3>() += by_path * path.asDiagonal() * by_path.transpose();
    covariance_(2, 2) += noise.heading_rad2_s * drive.driven_s;
    covariance_(0, 0) += noise.drift_mm2_s * h_s;
    covariance_(1, 1) += noise.drift_mm2_s * h_s;
    if (in_contact) covariance_(2, 2) += noise.contact_rad2_s * h_s;
  }
  /// Whitened innovations of sample k; then the update.
  void measure(std::size_t k, Eigen::MatrixXd& out) {
    const Eigen::Index size = conditions_.headings ? 3 : 2;
    Eigen::MatrixXd innovation = differences_.middleRows(row_of(k), size) - states_.topRows(size);
    Eigen::MatrixXd seen = covariance_.topLeftCorner(size, size);
    for (Eigen::Index i = 0; i < size; ++i)
      seen(i, i) += i < 2 ? conditions_.noise.position_mm2 : conditions_.noise.heading_rad2;
    const Eigen::LLT<Eigen::MatrixXd> root(seen);
    out.middleRows(row_of(k), size) = root.matrixL().solve(innovation);
    const Eigen::MatrixXd gain = root.solve(covariance_.topRows(size)).transpose();
    states_ += gain * innovation;
    covariance_ -= (gain * covariance_.topRows(size)).eval();
    covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  }

 private:
  [[nodiscard]] static Eigen::Index row_of(std::size_t k) { return static_cast<Eigen::Index>(k) * kSampleNumbers; }

  const RecordingConditions& conditions_;
  const PlannedRobot& robot_;
  const std::vector<Sample>& track_;
  const Eigen::MatrixXd& differences_;
  Eigen::Matrix2d bias_;
  Eigen::MatrixXd states_;  ///< a column per difference
  StateMatrix covariance_;
};

}  // namespace

Eigen::VectorXd difference_of(const std::vector<Sample>& track, const std::vector<Sample>& from) {
  const std::size_t samples = std::min(track.size(), from.size());
  Eigen::VectorXd out(static_cast<Eigen::Index>(samples) * kSampleNumbers);
  for (std::size_t k = 0; k < samples; ++k)
    out.segment<kSampleNumbers>(static_cast<Eigen::Index>(k) * kSampleNumbers) << track[k].x_mm - from[k].x_mm,
        track[k].y_mm - from[k].y_mm, wrapped_angle(track[k].heading_rad - from[k].heading_rad);
  return out;
}

Eigen::MatrixXd whitened(const RecordingConditions& conditions, const PlannedRobot& robot,
                         const std::vector<Sample>& track, const std::vector<bool>& usable,
                         const Eigen::MatrixXd& differences) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(differences.rows(), differences.cols());
  if (track.empty()) return out;
  Whitener filter(conditions, robot, track, differences);
  for (std::size_t k = 1; k < track.size(); ++k) {
    filter.predict(k, !usable[k]);
    if (usable[k] && usable[k - 1])
      filter.measure(k, out);
    else
      filter.place(k);
  }
  return out;
}

}  // namespace kilotwin::identify
