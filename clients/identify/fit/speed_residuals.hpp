/// Speed residuals between successive measurements of a track, relative to the robot's speed.
#pragma once

#include <Eigen/LU>
#include <cstdint>
#include <utility>
#include <vector>

#include "clients/identify/fit/contact_gate.hpp"

namespace kilotwin::identify {

/// Relative speed residual between two measurements: `score` / `information`, with the variance 1 / `information`.
struct SpeedResidual {
  double from_s, to_s;
  double score, information;
  double process;  ///< variance of the mean relative speed over this time by the model's process noise
};

/// Visitor of run_filter: the residuals of one track. Each assumes that the model was right before.
class SpeedResiduals {
 public:
  /// `during`: commands whose residuals count, as in Block.
  SpeedResiduals(const MotionModel& model, std::uint8_t during) : model_(model), during_(during) {}

  void start(const TrackFilter&) { clear(); }
  void step(const StepRecord& record) {
    in_contact_.step(record);
    if (empty_) from_s_ = record.middle.time_s - record.h_s / 2;
    empty_ = false;
    const Rates& r = record.rates;
    const StepJacobian ways = step_jacobian(record, model_.base.wheel_base_mm);
    pose_.head<2>() += ways.by_heading * pose_[2];
    if ((during_ >> static_cast<int>(record.middle.commands.command) & 1) == 0) return;
    const Eigen::Vector2d speeds(r.left_base_mm_s * r.left_gain, r.right_base_mm_s * r.right_gain);
    pose_ += record.h_s * ways.by_wheel * speeds;
    path_mm_ += record.h_s * speeds.mean();
    for (const double v : speeds)
      if (v != 0) path_mm2_ += record.h_s * (model_.noise.factor_s * v * v + model_.noise.wheel_mm2_s) / 4;
  }
  void update(const Innovation& innovation, const Sample& sample) {
    if (in_contact_.update(innovation) == ContactGate::Counts::kAll && !innovation.lost && !pose_.isZero(0)) {
      Eigen::Matrix3d jacobian = innovation.jacobian;
      if (innovation.size == 2) jacobian.row(2).setZero();
      const Eigen::Vector3d seen = jacobian * pose_;
      const Eigen::Vector3d weighed = innovation.covariance.inverse() * seen;
      all.push_back({from_s_, sample.time_s, weighed.dot(innovation.difference), weighed.dot(seen),
                     path_mm_ != 0 ? path_mm2_ / (path_mm_ * path_mm_) : 0});
    }
    clear();
  }
  /// Removes the mean of the track, which its biases do not explain.
  void remove_mean() {
    double score = 0, information = 0;
    for (const SpeedResidual& r : all) score += r.score, information += r.information;
    if (information > 0)
      for (SpeedResidual& r : all) r.score -= r.information * score / information;
  }
  std::vector<SpeedResidual> all;

 private:
  void clear() {
    pose_.setZero();
    path_mm_ = path_mm2_ = 0;
    empty_ = true;
  }
  const MotionModel& model_;
  const std::uint8_t during_;
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();
  ContactGate in_contact_;
  double from_s_ = 0, path_mm_ = 0, path_mm2_ = 0;
  bool empty_ = true;
};

}  // namespace kilotwin::identify
