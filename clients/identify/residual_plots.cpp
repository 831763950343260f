#include "clients/identify/residual_plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "clients/identify/result/values.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// A target or a covariate.
struct Quantity {
  const char *name, *unit;
  double Disturbance::*value;
};
constexpr std::array<Quantity, 4> kTargets = {{{"forward", "mm/s", &Disturbance::forward_mm_s},
                                               {"turn", "rad/s", &Disturbance::turn_rad_s},
                                               {"world_x", "mm/s", &Disturbance::world_x_mm_s},
                                               {"world_y", "mm/s", &Disturbance::world_y_mm_s}}};
constexpr std::array<Quantity, 5> kPlotCovariates = {
    {{"time", "s", &Disturbance::time_s},
     {"motor_time", "s", &Disturbance::motor_s},
     {"heading", "rad", &Disturbance::heading_rad},
     {"time_since_command", "s", &Disturbance::since_command_s},
     {"neighbours", "mm to the nearest", &Disturbance::nearest_mm}}};
/// Of the maps: what varies over the arena.
constexpr std::array<std::size_t, 3> kMapTargets = {0, 2, 3};
constexpr std::size_t kBins = 24, kCells = 14;
/// Farther neighbours count as this far.
constexpr double kFarthest_mm = 400;

/// The value of a covariate by which a disturbance is plotted.
double plotted(const Disturbance& d, const Quantity& covariate) {
  const double value = d.*covariate.value;
  return covariate.value == &Disturbance::nearest_mm ? std::min(value, kFarthest_mm) : value;
}

/// The central 99 %, by a part of the disturbances.
template <class Of> std::pair<double, double> range_of(const std::vector<Disturbance>& all, Of&& of) {
  std::vector<double> values;
  for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / 5000) values.push_back(of(all[i]));
  return {stats::lower_quantile(values, 0.005), stats::lower_quantile(values, 0.995)};
}

double middle_of(double low, double high, std::size_t bin, std::size_t bins) {
  return low + (high - low) * (static_cast<double>(bin) + 0.5) / static_cast<double>(bins);
}

/// Means over the bins of a covariate, and their standard errors.
struct BinMeans {
  std::array<double, kBins> mean{}, se{};

  BinMeans(const std::vector<Disturbance>& all, const Quantity& covariate, std::pair<double, double> range,
           const Quantity& target) {
    std::array<double, kBins> square{}, count{};
    for (const Disturbance& d : all) {
      const double part = (plotted(d, covariate) - range.first) / (range.second - range.first);
      if (!(part >= 0 && part <= 1)) continue;
      const std::size_t bin = std::min(static_cast<std::size_t>(part * kBins), kBins - 1);
      mean[bin] += d.*target.value;
      square[bin] += d.*target.value * (d.*target.value);
      count[bin] += 1;
    }
    for (std::size_t i = 0; i < kBins; ++i) {
      if (count[i] < 1) continue;
      mean[i] /= count[i];
      se[i] = std::sqrt(std::max(0.0, square[i] / count[i] - mean[i] * mean[i]) / count[i]);
    }
  }
};

using CellMeans = std::array<std::array<double, kCells>, kCells>;

/// Means over the cells of the arena, [y][x].
CellMeans cell_means(const std::vector<Disturbance>& all, std::pair<double, double> x_mm,
                     std::pair<double, double> y_mm, const Quantity& target) {
  CellMeans mean{}, count{};
  for (const Disturbance& d : all) {
    const double u = (d.x_mm - x_mm.first) / (x_mm.second - x_mm.first),
                 v = (d.y_mm - y_mm.first) / (y_mm.second - y_mm.first);
    if (!(u >= 0 && u < 1 && v >= 0 && v < 1)) continue;
    const auto column = static_cast<std::size_t>(u * kCells), row = static_cast<std::size_t>(v * kCells);
    mean[row][column] += d.*target.value;
    count[row][column] += 1;
  }
  for (std::size_t i = 0; i < kCells; ++i)
    for (std::size_t j = 0; j < kCells; ++j)
      if (count[i][j] > 0) mean[i][j] /= count[i][j];
  return mean;
}

void add_maps(identification::Identification& out, const std::vector<Disturbance>& before,
              const std::vector<Disturbance>& after) {
  const auto x_mm = range_of(before, [](const Disturbance&d) { return d.x_mm; }),
             y_mm = range_of(before, [](const Disturbance&d) { return d.y_mm; });
  if (!(x_mm.second > x_mm.first) || !(y_mm.second > y_mm.first)) return;
  for (const std::size_t t : kMapTargets) {
    identification::ResidualMap& map = *out.add_maps();
    map.set_target(kTargets[t].name);
    map.set_unit(kTargets[t].unit);
    for (std::size_t i = 0; i < kCells; ++i) {
      map.add_x_mm(middle_of(x_mm.first, x_mm.second, i, kCells));
      map.add_y_mm(middle_of(y_mm.first, y_mm.second, i, kCells));
    }
    for (const auto& row : cell_means(before, x_mm, y_mm, kTargets[t])) *map.add_before() = json_list(row);
    for (const auto& row : cell_means(after, x_mm, y_mm, kTargets[t])) *map.add_after() = json_list(row);
  }
}

}  // namespace

void add_residual_plots(identification::Identification& out, const std::vector<Disturbance>& before,
                        const std::vector<Disturbance>& after) {
  if (before.empty()) return;
  for (const Quantity& covariate : kPlotCovariates) {
    const auto range = range_of(before, [&](const Disturbance& d) { return plotted(d, covariate); });
    if (!(range.second > range.first)) continue;
    for (const Quantity& target : kTargets) {
      const BinMeans was(before, covariate, range, target), is(after, covariate, range, target);
      identification::CovariatePlot& plot = *out.add_covariate_plots();
      plot.set_target(target.name);
      plot.set_covariate(covariate.name);
      plot.set_unit(covariate.unit);
      plot.set_acts_on_unit(target.unit);
      for (std::size_t i = 0; i < kBins; ++i) plot.add_at(middle_of(range.first, range.second, i, kBins));
      assign(plot.mutable_before(), was.mean);
      assign(plot.mutable_before_se(), was.se);
      assign(plot.mutable_after(), is.mean);
    }
  }
  add_maps(out, before, after);
}

}  // namespace kilotwin::identify
