#include "clients/identify/fit/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

class Corrections {
 public:
  Corrections(std::uint32_t track, std::vector<Disturbance>& to) : track_(track), to_(to) {}

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) {
    last_ = record.middle;
    all_driven_ = all_driven_ && record.middle.commands.driven();
    in_contact_ = in_contact_ || record.in_contact();
    length_s_ += record.h_s;
  }
  void update(const Innovation& innovation, const Sample& sample) {
    const double length_s = std::exchange(length_s_, 0);
    const bool driven = std::exchange(all_driven_, true), free = !std::exchange(in_contact_, false);
    const bool counts = driven && free && !innovation.lost && innovation.weight == 1 && length_s > 0;
    if (!counts) return;
    const Eigen::Vector3d moved = innovation.gain.topRows<3>() * innovation.difference / length_s;
    const double c = std::cos(last_.heading_rad), s = std::sin(last_.heading_rad);
    to_.push_back({sample.time_s, innovation.pose[0] + kAxleOffset_mm * c, innovation.pose[1] + kAxleOffset_mm * s,
                   wrapped_angle(last_.heading_rad), last_.commands.since_s,
                   (last_.commands.motor_s[0] + last_.commands.motor_s[1]) / 2, last_.near.nearest_mm,
                   c * moved[0] + s * moved[1], c * moved[1] - s * moved[0], moved[2], moved[0], moved[1], track_});
  }

 private:
  const std::uint32_t track_;
  std::vector<Disturbance>& to_;
  Situation last_;
  double length_s_ = 0;
  bool all_driven_ = true, in_contact_ = false;
};

}  // namespace

std::vector<Disturbance> disturbances_of(const FitState& state, std::uint32_t threads) {
  const MotionModel& model = state.model;
  PreparedSet set = state.tracks;
  set.find_headings(model, threads);
  std::vector<std::vector<Disturbance>> parts(set.views().size());
  os::in_parallel(parts.size(), threads, [&](std::size_t v) {
    const TrackView& view = set.views()[v];
    RobotBias bias = model.bias_of(view.track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, view.track->robot, view.number);
    Corrections corrections(static_cast<std::uint32_t>(v), parts[v]);
    run_filter(filter, view, view.track->samples.size(), corrections);
  });
  std::vector<Disturbance> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace kilotwin::identify
