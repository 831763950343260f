#include "clients/identify/predict/held_out_gain.hpp"

#include <cmath>
#include <map>

#include "clients/identify/fit/likelihood.hpp"
#include "clients/identify/fit/linearisation.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// One per view of the set.
std::vector<double> log_likelihoods(const MotionModel& model, PreparedSet set, std::uint32_t threads) {
  set.find_headings(model, threads);
  std::vector<double> sums(set.views().size());
  os::in_parallel(sums.size(), threads, [&](std::size_t v) {
    const TrackView& view = set.views()[v];
    TrackFilter filter(model, model.bias_of(view.track->robot), view.track->robot, view.number);
    LogLikelihood likelihood;
    likelihood.include_contacts = true;
    run_filter(filter, view, view.track->samples.size(), likelihood);
    sums[v] = likelihood.sum;
  });
  return sums;
}

}  // namespace

HeldOutGain held_out_gain(const MotionModel& with, const MotionModel& without, const PreparedSet& set, Tracks of,
                          std::uint32_t threads) {
  const std::vector<double> less = log_likelihoods(without, set, threads),
                            more = log_likelihoods(with, set, threads);
  std::map<std::uint32_t, double> by_robot;
  for (std::size_t v = 0; v < more.size(); ++v) {
    const Track& track = *set.views()[v].track;
    if (counts(track, of)) by_robot[track.robot] += more[v] - less[v];
  }
  HeldOutGain gain;
  for (const auto& [robot, nat] : by_robot) gain.nat += nat;
  const double n = static_cast<double>(by_robot.size());
  if (by_robot.size() < 2) return gain;
  double square = 0;
  for (const auto& [robot, nat] : by_robot) square += (nat - gain.nat / n) * (nat - gain.nat / n);
  gain.nat_se = std::sqrt(square * n / (n - 1));
  return gain;
}

}  // namespace kilotwin::identify
