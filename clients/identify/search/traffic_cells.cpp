#include "clients/identify/search/traffic_cells.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

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

/// A robot at an instant: position and speed residual.
struct Visit {
  float x_mm, y_mm;
  float score, information;
  bool driven;
};
using Instant = std::vector<Visit>;

/// [run][instant]. Long sets: the beginning of every run.
std::vector<std::vector<Instant>> visits_of(const Fitter& fitter, const FitState& state, std::uint8_t during) {
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
    for (Residual& r : residuals[v]) r.score -= r.information * score / information;
  });
  constexpr std::size_t kMost = 150000;
  std::vector<std::vector<Instant>> runs(set.set().runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunNeighbours& near = set.neighbours(r);
    const std::size_t tracks = set.set().runs[r].tracks.size();
    if (tracks == 0) continue;
    runs[r].resize(std::min(near.instants(), kMost / runs.size() / tracks));
    // [track][instant].
    std::vector<std::vector<std::pair<float, float>>> known(tracks);
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v].run != r) continue;
      auto& own = known[views[v].place];
      own.assign(runs[r].size(), {0.0F, 0.0F});
      for (const Residual& residual : residuals[v]) {
        const auto at = [&](double time_s) {
          const double i = std::ceil((time_s - near.time_s(0)) / RunNeighbours::kRaster_s - 1e-6);
          return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(own.size())));
        };
        const std::size_t first = at(residual.from_s), last = at(residual.to_s);
        const auto share = 1.0F / static_cast<float>(std::max<std::size_t>(last - first, 1));
        for (std::size_t i = first; i < last; ++i)
          own[i] = {share * static_cast<float>(residual.score), share * static_cast<float>(residual.information)};
      }
    }
    for (std::size_t i = 0; i < runs[r].size(); ++i) {
      for (std::size_t t = 0; t < tracks; ++t) {
        const RunNeighbours::Spot& s = near.spot(t, i);
        if (std::isnan(s.x_mm)) continue;
        const auto [score, information] = known[t].empty() ? std::pair{0.0F, 0.0F} : known[t][i];
        runs[r][i].push_back(
            {static_cast<float>(s.x_mm), static_cast<float>(s.y_mm), score, information, s.driven});
      }
    }
  }
  return runs;
}

/// Classes of driven time per cell, with increasing width.
class Classes {
 public:
  static constexpr std::size_t kCount = 16;
  Classes() {
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const double time_s = static_cast<double>(i) * RunNeighbours::kRaster_s;
      of_[i] = static_cast<std::uint8_t>(std::min(2.4 * std::log2(1 + 2 * time_s), kCount - 1.0));
    }
  }
  [[nodiscard]] std::size_t of(float time_s) const {
    const float i = time_s * static_cast<float>(1 / RunNeighbours::kRaster_s) + 0.5F;
    return of_[std::min(static_cast<std::size_t>(i), of_.size() - 1)];
  }

 private:
  std::array<std::uint8_t, 512> of_;
};

/// Half the sum of squares that a speed per class explains.
double explained(const std::vector<std::vector<Instant>>& runs, const GridCells& cells) {
  static const Classes classes;
  std::array<double, Classes::kCount> score{}, information{};
  for (const std::vector<Instant>& run : runs) {
    TrafficGrid traffic(cells);
    for (const Instant& instant : run) {
      for (const Visit& v : instant) {
        if (v.information == 0) continue;
        const std::size_t c = classes.of(traffic.value_s(v.x_mm, v.y_mm));
        score[c] += v.score;
        information[c] += v.information;
      }
      for (const Visit& v : instant)
        if (v.driven) traffic.add(v.x_mm, v.y_mm, RunNeighbours::kRaster_s);
    }
  }
  double sum = 0;
  for (std::size_t c = 0; c < score.size(); ++c)
    if (information[c] > 0) sum += 0.5 * score[c] * score[c] / information[c];
  return sum;
}

struct RatedCells {
  GridCells cells;
  double value = -1;
};

/// Coordinate ascent with decreasing steps.
RatedCells climbed(const std::vector<std::vector<Instant>>& runs, RatedCells best, double extent_mm) {
  constexpr double kFinest = 0.004;  // relative to the cell side
  for (double step = 0.16; step > kFinest; step /= 2) {
    for (bool better = true; better;) {
      better = false;
      // A step in the cell side displaces the outermost cells by that share of their side.
      const double side = best.cells.side_mm, move = step * side;
      for (const auto& [by_side, by_x, by_y] :
           {std::array{move * side / extent_mm, 0.0, 0.0}, {0.0, move, 0.0}, {0.0, 0.0, move}}) {
        for (const double sign : {1.0, -1.0}) {
          RatedCells trial;
          trial.cells = {best.cells.side_mm + sign * by_side, best.cells.x_mm + sign * by_x,
                         best.cells.y_mm + sign * by_y};
          trial.value = explained(runs, trial.cells);
          if (trial.value <= best.value) continue;
          best = trial;
          better = true;
          break;
        }
      }
    }
  }
  // The cell corner nearest to the origin.
  best.cells.x_mm = std::remainder(best.cells.x_mm, best.cells.side_mm);
  best.cells.y_mm = std::remainder(best.cells.y_mm, best.cells.side_mm);
  return best;
}

}  // namespace

GridCells fit_grid_cells(const Fitter& fitter, const FitState& state, const GridCells& from, std::uint8_t during) {
  const std::vector<std::vector<Instant>> runs = visits_of(fitter, state, during);
  std::vector<float> away;
  for (const auto& run : runs)
    for (const Instant& instant : run)
      for (const Visit& v : instant) away.push_back(std::max(std::abs(v.x_mm), std::abs(v.y_mm)));
  if (away.empty()) return from;
  const auto most = away.end() - 1 - static_cast<std::ptrdiff_t>(away.size() / 50);
  std::nth_element(away.begin(), most, away.end());
  const double extent_mm = std::max<double>(*most, from.side_mm);
  // Grid of the global search: sides so dense that the outermost cells still match, corners a third of a cell
  // apart.
  constexpr double kSmallest_mm = 14, kLargest_mm = 150;
  constexpr int kCorners = 3;
  std::vector<RatedCells> all{{from, 0}};
  for (double side = kSmallest_mm; side < kLargest_mm; side *= 1 + 0.3 * side / extent_mm)
    for (int i = 0; i < kCorners; ++i)
      for (int j = 0; j < kCorners; ++j) all.push_back({{side, side * i / kCorners, side * j / kCorners}, 0});
  os::in_parallel(all.size(), fitter.threads(),
                  [&](std::size_t i) { all[i].value = explained(runs, all[i].cells); });
  std::stable_sort(all.begin(), all.end(),
                   [](const RatedCells& a, const RatedCells& b) { return a.value > b.value; });
  constexpr std::size_t kClimbed = 6;
  all.resize(std::min(all.size(), kClimbed));
  os::in_parallel(all.size(), fitter.threads(), [&](std::size_t i) { all[i] = climbed(runs, all[i], extent_mm); });
  return std::max_element(all.begin(), all.end(),
                          [](const RatedCells& a, const RatedCells& b) { return a.value < b.value; })
      ->cells;
}

}  // namespace kilotwin::identify
