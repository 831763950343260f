#include "clients/identify/fit/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

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
    const bool counts = std::exchange(all_driven_, true) && !std::exchange(in_contact_, false) &&
                        !innovation.lost && innovation.weight == 1 && length_s > 0;
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

double bounded_quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <class Of> std::pair<double, double> range_of(const std::vector<Disturbance>& all, Of&& of) {
  std::vector<double> values;
  for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / 5000) values.push_back(of(all[i]));
  return {bounded_quantile(values, 0.005), bounded_quantile(values, 0.995)};
}

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

json covariate_plots(const std::vector<Disturbance>& before, const std::vector<Disturbance>& after) {
  struct Of {
    const char *name, *unit;
    double Disturbance::*value;
  };
  const Of targets[] = {{"forward", "mm/s", &Disturbance::forward_mm_s},
                        {"turn", "rad/s", &Disturbance::turn_rad_s},
                        {"world_x", "mm/s", &Disturbance::world_x_mm_s},
                        {"world_y", "mm/s", &Disturbance::world_y_mm_s}};
  const Of covariates[] = {{"time", "s", &Disturbance::time_s},
                           {"motor_time", "s", &Disturbance::motor_s},
                           {"heading", "rad", &Disturbance::heading_rad},
                           {"time_since_command", "s", &Disturbance::since_command_s},
                           {"neighbours", "mm to the nearest", &Disturbance::nearest_mm}};
  constexpr std::size_t kBins = 24;
  json plots = json::array();
  if (before.empty()) return plots;
  for (const Of& covariate : covariates) {
    auto [low, high] = range_of(before, [&](const Disturbance& d) { return std::min(d.*covariate.value, 400.0); });
    if (!(high > low)) continue;
    const auto means = [&, low = low, high = high](const std::vector<Disturbance>& all, const Of& target,
                                                   std::vector<double>& se) {
      std::vector<double> sum(kBins), square(kBins), count(kBins);
      for (const Disturbance& d : all) {
        const double part = (d.*covariate.value - low) / (high - low);
        if (!(part >= 0 && part < 1)) continue;
        const auto bin = static_cast<std::size_t>(part * kBins);
        sum[bin] += d.*target.value;
        square[bin] += d.*target.value * (d.*target.value);
        count[bin] += 1;
      }
      se.assign(kBins, 0);
      for (std::size_t i = 0; i < kBins; ++i) {
        if (count[i] < 1) continue;
        sum[i] /= count[i];
        se[i] = std::sqrt(std::max(0.0, square[i] / count[i] - sum[i] * sum[i]) / count[i]);
      }
      return sum;
    };
    std::vector<double> at(kBins);
    for (std::size_t i = 0; i < kBins; ++i) at[i] = low + (high - low) * (static_cast<double>(i) + 0.5) / kBins;
    for (const Of& target : targets) {
      std::vector<double> se, se_after;
      const std::vector<double> was = means(before, target, se), is = means(after, target, se_after);
      plots.push_back({{"target", target.name},
                       {"covariate", covariate.name},
                       {"unit", covariate.unit},
                       {"acts_on_unit", target.unit},
                       {"at", at},
                       {"before", was},
                       {"before_se", se},
                       {"after", is},
                       {"fitted", nullptr}});
    }
  }
  return plots;
}

json maps(const std::vector<Disturbance>& before, const std::vector<Disturbance>& after) {
  json all = json::array();
  if (before.empty()) return all;
  const auto [x_low, x_high] = range_of(before, [](const Disturbance& d) { return d.x_mm; });
  const auto [y_low, y_high] = range_of(before, [](const Disturbance& d) { return d.y_mm; });
  if (!(x_high > x_low) || !(y_high > y_low)) return all;
  constexpr std::size_t kCells = 14;
  struct Of {
    const char *name, *unit;
    double Disturbance::*value;
  };
  for (const Of& target :
       {Of{"forward", "mm/s", &Disturbance::forward_mm_s}, Of{"world_x", "mm/s", &Disturbance::world_x_mm_s},
        Of{"world_y", "mm/s", &Disturbance::world_y_mm_s}}) {
    std::vector<std::vector<double>> grids[2], count(kCells, std::vector<double>(kCells));
    int which = 0;
    for (const auto* set : {&before, &after}) {
      auto& grid = grids[which];
      grid.assign(kCells, std::vector<double>(kCells));
      std::vector<std::vector<double>> own(kCells, std::vector<double>(kCells));
      for (const Disturbance& d : *set) {
        const double u = (d.x_mm - x_low) / (x_high - x_low), v = (d.y_mm - y_low) / (y_high - y_low);
        if (!(u >= 0 && u < 1 && v >= 0 && v < 1)) continue;
        const auto column = static_cast<std::size_t>(u * kCells), row = static_cast<std::size_t>(v * kCells);
        grid[row][column] += d.*target.value;
        own[row][column] += 1;
      }
      for (std::size_t i = 0; i < kCells; ++i)
        for (std::size_t j = 0; j < kCells; ++j)
          if (own[i][j] > 0) grid[i][j] /= own[i][j];
      if (which++ == 0) count = own;
    }
    std::vector<double> xs, ys;
    for (std::size_t i = 0; i < kCells; ++i) {
      xs.push_back(x_low + (x_high - x_low) * (static_cast<double>(i) + 0.5) / kCells);
      ys.push_back(y_low + (y_high - y_low) * (static_cast<double>(i) + 0.5) / kCells);
    }
    all.push_back({{"target", target.name},
                   {"unit", target.unit},
                   {"x_mm", xs},
                   {"y_mm", ys},
                   {"before", grids[0]},
                   {"after", grids[1]},
                   {"count", count}});
  }
  return all;
}

}  // namespace kilotwin::identify
