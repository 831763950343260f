#include "clients/identify/fit/noise_samples.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/filter_pass.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

/// A visitor of run_filter() that accumulates the process noise between samples, as the filter does.
class ProcessRecorder {
 public:
  ProcessRecorder(const MotionModel& model, NoiseSample track, std::vector<NoiseSample>& to)
      : model_(model), track_(std::move(track)), to_(to) {}

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) {
    last_ = record.middle;
    counts_ = counts_ && record.middle.commands.driven() && !record.in_contact();
    const StepJacobian by = step_jacobian(record, model_.base.wheel_base_mm);
    Eigen::Matrix3d moved = Eigen::Matrix3d::Identity();
    moved.block<2, 1>(0, 2) = by.by_heading;
    process_ = (moved * process_ * moved.transpose()).eval();
    const Noise& noise = model_.noise;
    const Eigen::Vector2d speeds = record.rates.driven_mm_s();
    const Eigen::Vector2d paths_mm2 =
        record.h_s * (noise.factor_s * speeds.cwiseAbs2() + Eigen::Vector2d::Constant(noise.wheel_mm2_s));
    process_ += by.by_wheel * paths_mm2.asDiagonal() * by.by_wheel.transpose();
    process_(2, 2) += record.h_s * noise.heading_rad2_s;
  }
  void update(const Innovation& innovation, const Sample& sample) {
    const Eigen::Matrix3d process = std::exchange(process_, Eigen::Matrix3d::Zero());
    const bool counts = std::exchange(counts_, true) && !innovation.lost && innovation.weight == 1;
    if (!counts) return;
    NoiseSample one = track_;
    one.time_s = sample.time_s;
    one.x_mm = last_.x_mm;
    one.y_mm = last_.y_mm;
    one.at = last_;
    one.size = innovation.size;
    one.difference = innovation.difference;
    one.covariance = innovation.covariance;
    one.process = innovation.jacobian * process * innovation.jacobian.transpose();
    to_.push_back(one);
  }

 private:
  const MotionModel& model_;
  const NoiseSample track_;
  std::vector<NoiseSample>& to_;
  Situation last_;
  Eigen::Matrix3d process_ = Eigen::Matrix3d::Zero();
  bool counts_ = true;
};

}  // namespace

double NoiseSample::log_likelihood(double scale) const {
  const Eigen::MatrixXd s = (covariance + (scale - 1) * process).topLeftCorner(size, size);
  const Eigen::VectorXd e = difference.head(size);
  return -0.5 * (std::log(s.determinant()) + e.dot(s.inverse() * e));
}

NoiseSample::Score NoiseSample::score(double scale) const {
  const Eigen::MatrixXd inverse = (covariance + (scale - 1) * process).topLeftCorner(size, size).inverse();
  const Eigen::MatrixXd share = inverse * (scale * process.topLeftCorner(size, size));
  const Eigen::VectorXd e = difference.head(size);
  return {0.5 * (e.dot(share * inverse * e) - share.trace()), 0.5 * (share * share).trace()};
}

double NoiseSample::whitened_square() const {
  const Eigen::VectorXd e = difference.head(size);
  return e.dot(covariance.topLeftCorner(size, size).inverse() * e) / size;
}

std::vector<NoiseSample> noise_samples_of(const FitState& state, std::uint32_t threads) {
  const MotionModel& model = state.model;
  const std::vector<TrackView>& views = state.tracks.views();
  std::vector<std::vector<NoiseSample>> parts(views.size());
  os::in_parallel(parts.size(), threads, [&](std::size_t v) {
    const TrackView& view = views[v];
    RobotBias bias = model.bias_of(view.track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, view.track->robot, view.number);
    NoiseSample track;
    track.robot = view.track->robot;
    track.track = v;
    track.held_out = view.track->held_out;
    run_filter(filter, view, view.track->samples.size(), ProcessRecorder(model, track, parts[v]));
  });
  std::vector<NoiseSample> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::map<std::uint32_t, NoiseRatio> noise_ratios_of(const std::vector<NoiseSample>& samples) {
  struct Stretch {
    double sum = 0, count = 0;
  };
  std::map<std::uint32_t, std::map<std::pair<std::size_t, double>, Stretch>> robots;
  for (const NoiseSample& sample : samples) {
    if (sample.held_out) continue;
    Stretch& stretch = robots[sample.robot][{sample.track, std::floor(sample.time_s / kNoiseStretch_s)}];
    stretch.sum += sample.whitened_square();
    stretch.count += 1;
  }
  constexpr std::size_t kFewest = 3;  // stretches; with fewer, their spread gives no interval, and the robot none
  std::map<std::uint32_t, NoiseRatio> ratios;
  for (const auto& [robot, stretches] : robots) {
    if (stretches.size() < kFewest) continue;
    Stretch all;
    for (const auto& [where, stretch] : stretches) {
      all.sum += stretch.sum;
      all.count += stretch.count;
    }
    const double mean = all.sum / all.count;
    double squares = 0;
    for (const auto& [where, stretch] : stretches) {
      const double off = stretch.sum - mean * stretch.count;
      squares += off * off;
    }
    const auto n = static_cast<double>(stretches.size());
    const double half = stats::kNormal95 * std::sqrt(squares * n / (n - 1)) / all.count;
    ratios[robot] = {mean, std::max(0.0, mean - half), mean + half};
  }
  return ratios;
}

}  // namespace kilotwin::identify
