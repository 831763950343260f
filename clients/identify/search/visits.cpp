#include "clients/identify/search/visits.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/contact_gate.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Relative speed residual between two measurements, and its precision.
struct Residual {
  double from_s, to_s;
  double score, information;
};

/// Residuals of one track. Each assumes that the model was right before.
class SpeedResiduals {
 public:
  SpeedResiduals(const MotionModel& model, std::uint8_t during) : model_(model), during_(during) {}

  void start(const TrackFilter&) { pose_.setZero(); }
  void step(const StepRecord& record) {
    in_contact_.step(record);
    if (empty_) from_s_ = record.middle.time_s - record.h_s / 2;
    empty_ = false;
    const Rates& r = record.rates;
    const StepJacobian ways = step_jacobian(record, model_.base.wheel_base_mm);
    pose_.head<2>() += ways.by_heading * pose_[2];
    if ((during_ >> static_cast<int>(record.middle.commands.command) & 1) == 0) return;
    pose_ += record.h_s * ways.by_wheel *
             Eigen::Vector2d(r.left_base_mm_s * r.left_gain, r.right_base_mm_s * r.right_gain);
  }
  void update(const Innovation& innovation, const Sample& sample) {
    if (in_contact_.update(innovation) == ContactGate::Counts::kAll && !innovation.lost && !pose_.isZero(0)) {
      Eigen::Matrix3d jacobian = innovation.jacobian;
      if (innovation.size == 2) jacobian.row(2).setZero();
      const Eigen::Vector3d seen = jacobian * pose_;
      const Eigen::Vector3d weighed = innovation.covariance.inverse() * seen;
      all.push_back({from_s_, sample.time_s, weighed.dot(innovation.difference), weighed.dot(seen)});
    }
    pose_.setZero();
    empty_ = true;
  }
  std::vector<Residual> all;

 private:
  const MotionModel& model_;
  const std::uint8_t during_;
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();
  ContactGate in_contact_;
  double from_s_ = 0;
  bool empty_ = true;
};

}  // namespace

Visits visits_of(const Fitter& fitter, const FitState& state, std::uint8_t during) {
  const MotionModel& model = state.model;
  const PreparedSet& set = state.tracks;
  const std::vector<TrackView>& views = set.views();
  std::vector<std::vector<Residual>> residuals(views.size());
  os::in_parallel(views.size(), fitter.threads(), [&](std::size_t v) {
    if (views[v].track->held_out) return;
    RobotBias bias = model.bias_of(views[v].track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, views[v].track->robot, views[v].number);
    SpeedResiduals sums(model, during);
    run_filter(filter, views[v], views[v].track->samples.size(), sums);
    residuals[v] = std::move(sums.all);
    // Removes the mean of each robot.
    double score = 0, information = 0;
    for (const Residual& r : residuals[v]) score += r.score, information += r.information;
    if (information > 0)
      for (Residual& r : residuals[v]) r.score -= r.information * score / information;
  });
  constexpr std::size_t kMost = 150000;
  const auto tracks_of = [&](std::size_t r) { return set.set().runs[r].tracks.size(); };
  std::vector<std::vector<Instant>> runs(set.set().runs.size());
  std::size_t all = 0;
  for (std::size_t r = 0; r < runs.size(); ++r)
    if (tracks_of(r) > 0) all += set.neighbours(r).instants() * tracks_of(r);
  const std::size_t every = all / kMost + 1;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunNeighbours& near = set.neighbours(r);
    const std::size_t tracks = tracks_of(r);
    if (tracks == 0) continue;
    runs[r].resize((near.instants() + every - 1) / every);
    // [track][instant].
    std::vector<std::vector<std::pair<float, float>>> known(tracks);
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v].run != r) continue;
      auto& own = known[views[v].place];
      own.assign(runs[r].size(), {0.0F, 0.0F});
      for (const Residual& residual : residuals[v]) {
        const auto at = [&](double time_s) {
          const double i = std::ceil((time_s - near.time_s(0)) / RunNeighbours::kRaster_s - 1e-6);
          return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(near.instants())));
        };
        const std::size_t first = at(residual.from_s), last = at(residual.to_s);
        const auto share = 1.0F / static_cast<float>(std::max<std::size_t>(last - first, 1));
        for (std::size_t i = first; i < last; ++i) {
          own[i / every].first += share * static_cast<float>(residual.score);
          own[i / every].second += share * static_cast<float>(residual.information);
        }
      }
    }
    for (std::size_t i = 0; i < runs[r].size(); ++i) {
      for (std::size_t t = 0; t < tracks; ++t) {
        const RunNeighbours::Spot& s = near.spot(t, i * every);
        if (std::isnan(s.x_mm)) continue;
        const auto [score, information] = known[t].empty() ? std::pair{0.0F, 0.0F} : known[t][i];
        runs[r][i].push_back(
            {static_cast<float>(s.x_mm), static_cast<float>(s.y_mm), score, information, s.driven});
      }
    }
  }
  return {std::move(runs), static_cast<double>(every) * RunNeighbours::kRaster_s};
}

}  // namespace kilotwin::identify
