#include "clients/identify/report/prediction_residuals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace kilotwin::identify {
namespace {

using nlohmann::json;

// Longest gap over which positions are interpolated.
constexpr double kGap_s = 2.5;
// A predicted displacement shorter than this has no usable direction.
constexpr double kLeastWay_mm = 5;
constexpr double kNearby_mm = 100;
constexpr std::size_t kBins = 14, kFewestInBin = 8;
constexpr std::size_t kCells = 10, kFewestInCell = 3;

struct Place {
  double x_mm, y_mm;
};

std::optional<Place> seen_at(const Track& track, double time_s) {
  const auto after = std::lower_bound(track.samples.begin(), track.samples.end(), time_s - 1e-9,
                                      [](const Sample& s, double t) { return s.time_s < t; });
  if (after == track.samples.end()) return std::nullopt;
  if (after->time_s < time_s + 1e-9) return Place{after->x_mm, after->y_mm};
  if (after == track.samples.begin()) return std::nullopt;
  const Sample& before = *std::prev(after);
  const double gap = after->time_s - before.time_s;
  if (gap > kGap_s) return std::nullopt;
  const double u = (time_s - before.time_s) / gap;
  return Place{before.x_mm + u * (after->x_mm - before.x_mm), before.y_mm + u * (after->y_mm - before.y_mm)};
}

/// Components of a residual.
enum Target : std::uint8_t { kAhead, kLeft, kX, kY, kTargets };
constexpr std::array<const char*, kTargets> kTargetNames = {"ahead", "left", "residual_x", "residual_y"};

struct Window {
  std::uint32_t robot;
  Place halfway;
  bool has_way;  // whether kAhead and kLeft are defined
  std::array<double, kTargets> before, after;
  std::map<std::string, double> covariates;
};

/// Driven time of a robot until time_s, s.
double driven_s(const Track& track, double time_s) {
  double sum = 0;
  for (std::size_t k = 0; k < track.commands.size(); ++k) {
    const double from = std::max(track.commands[k].time_s, 0.0);
    const double to = std::min(k + 1 < track.commands.size() ? track.commands[k + 1].time_s : time_s, time_s);
    if (track.commands[k].motion != Motion::kStop && to > from) sum += to - from;
  }
  return sum;
}

std::optional<Window> window_of(const Run& run, const Track& track, const Prediction& p, double horizon_s) {
  const auto end = seen_at(track, p.time_s), start = seen_at(track, p.time_s - horizon_s),
             halfway = seen_at(track, p.time_s - 0.5 * horizon_s);
  if (!end || !start || !halfway) return std::nullopt;
  Window w{p.robot, *halfway, false, {}, {}, {}};
  const double way_x = p.before_x_mm - start->x_mm, way_y = p.before_y_mm - start->y_mm,
               way = std::hypot(way_x, way_y);
  w.has_way = way > kLeastWay_mm;
  const auto split = [&](double x, double y) {
    const double u = w.has_way ? way_x / way : 1, v = w.has_way ? way_y / way : 0;
    return std::array<double, kTargets>{x * u + y * v, y * u - x * v, x, y};
  };
  w.before = split(end->x_mm - p.before_x_mm, end->y_mm - p.before_y_mm);
  w.after = split(end->x_mm - p.after_x_mm, end->y_mm - p.after_y_mm);
  const double middle_s = p.time_s - 0.5 * horizon_s;
  w.covariates["time"] = middle_s;
  w.covariates["x"] = halfway->x_mm;
  w.covariates["y"] = halfway->y_mm;
  w.covariates["radius"] = std::hypot(halfway->x_mm, halfway->y_mm);
  w.covariates["robot"] = p.robot;
  if (w.has_way) w.covariates["heading"] = std::atan2(way_y, way_x);
  if (track.commands.size() > 1) w.covariates["driven_time"] = driven_s(track, middle_s);
  double near = 0;
  for (const Track& other : run.tracks) {
    if (&other == &track) continue;
    const auto there = seen_at(other, middle_s);
    if (there && std::hypot(there->x_mm - halfway->x_mm, there->y_mm - halfway->y_mm) < kNearby_mm) near += 1;
  }
  w.covariates["neighbours"] = near;
  return w;
}

struct Bins {
  std::vector<double> at, before, before_se, after;
  double strength = 0;  // mean over the bins of (mean / standard error)^2
};

/// Means over bins with about equal numbers of windows. Integer values below 60 have one bin each.
Bins bins_of(const std::vector<Window>& windows, const std::string& covariate, Target target, double overlap) {
  std::vector<std::pair<double, const Window*>> sorted;
  for (const Window& w : windows) {
    const auto at = w.covariates.find(covariate);
    if (at != w.covariates.end() && (target >= kX || w.has_way)) sorted.emplace_back(at->second, &w);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const bool whole = covariate == "robot" || covariate == "neighbours";
  const std::size_t in_bin = whole ? 1 : std::max(kFewestInBin, (sorted.size() + kBins - 1) / kBins);
  Bins bins;
  for (std::size_t from = 0, to = 0; from < sorted.size(); from = to) {
    to = std::min(from + in_bin, sorted.size());
    while (to < sorted.size() && sorted[to].first == sorted[to - 1].first) ++to;
    const auto count = static_cast<double>(to - from);
    if (to - from < kFewestInBin) continue;
    double at = 0, before = 0, after = 0, square = 0;
    for (std::size_t k = from; k < to; ++k) {
      at += sorted[k].first / count;
      before += sorted[k].second->before[target] / count;
      after += sorted[k].second->after[target] / count;
    }
    for (std::size_t k = from; k < to; ++k) square += std::pow(sorted[k].second->before[target] - before, 2);
    const double se = std::sqrt(square / (count - 1) * overlap / count);
    bins.at.push_back(at);
    bins.before.push_back(before);
    bins.before_se.push_back(se);
    bins.after.push_back(after);
    if (se > 0) bins.strength += before * before / (se * se);
  }
  if (!bins.at.empty()) bins.strength /= static_cast<double>(bins.at.size());
  return bins;
}

json covariate_plots(const std::vector<Window>& windows, double overlap) {
  const std::vector<std::pair<const char*, const char*>> covariates = {
      {"time", "s"},    {"driven_time", "s"}, {"x", "mm"},        {"y", "mm"},
      {"radius", "mm"}, {"heading", "rad"},   {"neighbours", ""}, {"robot", ""}};
  std::vector<std::pair<double, json>> found;
  for (const auto& [covariate, unit] : covariates) {
    Bins best;
    Target target = kAhead;
    for (std::uint8_t t = 0; t < kTargets; ++t) {
      Bins bins = bins_of(windows, covariate, static_cast<Target>(t), overlap);
      if (bins.at.size() < 2 || bins.strength <= best.strength) continue;
      best = std::move(bins);
      target = static_cast<Target>(t);
    }
    if (best.at.size() < 2) continue;
    found.emplace_back(best.strength, json{{"target", kTargetNames[target]},
                                           {"covariate", covariate},
                                           {"unit", unit},
                                           {"acts_on_unit", "mm"},
                                           {"at", best.at},
                                           {"before", best.before},
                                           {"before_se", best.before_se},
                                           {"after", best.after},
                                           {"fitted", nullptr}});
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  json out = json::array();
  for (auto& [strength, plot] : found) out.push_back(std::move(plot));
  return out;
}

json maps(const std::vector<Window>& windows) {
  json out = json::array();
  if (windows.empty()) return out;
  double low_x = 1e300, high_x = -1e300, low_y = 1e300, high_y = -1e300;
  for (const Window& w : windows) {
    low_x = std::min(low_x, w.halfway.x_mm);
    high_x = std::max(high_x, w.halfway.x_mm);
    low_y = std::min(low_y, w.halfway.y_mm);
    high_y = std::max(high_y, w.halfway.y_mm);
  }
  // Square cells.
  const double cell = std::max({high_x - low_x, high_y - low_y, 1.0}) / static_cast<double>(kCells);
  const auto count_of = [&](double low, double high) {
    return std::max<std::size_t>(2, static_cast<std::size_t>(std::ceil((high - low) / cell)));
  };
  const std::size_t columns = count_of(low_x, high_x), rows = count_of(low_y, high_y);
  std::vector<double> x(columns), y(rows);
  for (std::size_t c = 0; c < columns; ++c) x[c] = low_x + (static_cast<double>(c) + 0.5) * cell;
  for (std::size_t r = 0; r < rows; ++r) y[r] = low_y + (static_cast<double>(r) + 0.5) * cell;
  const auto place = [&](double value, double low, std::size_t count) {
    return std::min(static_cast<std::size_t>(std::max(0.0, (value - low) / cell)), count - 1);
  };
  for (const Target target : {kX, kY}) {
    std::vector<std::vector<double>> before(rows, std::vector<double>(columns)), after = before;
    std::vector<std::vector<std::size_t>> count(rows, std::vector<std::size_t>(columns));
    for (const Window& w : windows) {
      const std::size_t r = place(w.halfway.y_mm, low_y, rows), c = place(w.halfway.x_mm, low_x, columns);
      before[r][c] += w.before[target];
      after[r][c] += w.after[target];
      ++count[r][c];
    }
    json means_before = json::array(), means_after = json::array();
    for (std::size_t r = 0; r < rows; ++r) {
      json row_before = json::array(), row_after = json::array();
      for (std::size_t c = 0; c < columns; ++c) {
        const bool enough = count[r][c] >= kFewestInCell;
        const auto n = static_cast<double>(count[r][c]);
        row_before.push_back(enough ? json(before[r][c] / n) : json());
        row_after.push_back(enough ? json(after[r][c] / n) : json());
      }
      means_before.push_back(std::move(row_before));
      means_after.push_back(std::move(row_after));
    }
    out.push_back({{"target", kTargetNames[target]},
                   {"unit", "mm"},
                   {"x_mm", x},
                   {"y_mm", y},
                   {"before", means_before},
                   {"after", means_after},
                   {"count", count}});
  }
  return out;
}

json robots(const std::vector<Window>& windows) {
  struct Sum {
    double before = 0, after = 0, count = 0;
  };
  std::map<std::uint32_t, Sum> sums;
  for (const Window& w : windows) {
    Sum& sum = sums[w.robot];
    sum.before += w.before[kX] * w.before[kX] + w.before[kY] * w.before[kY];
    sum.after += w.after[kX] * w.after[kX] + w.after[kY] * w.after[kY];
    sum.count += 1;
  }
  json out = json::array();
  for (const auto& [robot, sum] : sums) {
    out.push_back({{"robot", robot},
                   {"before_mm", std::sqrt(sum.before / sum.count)},
                   {"after_mm", std::sqrt(sum.after / sum.count)}});
  }
  return out;
}

}  // namespace

json residual_parts(const MeasuredSet& set, const std::vector<Prediction>& predictions, double horizon_s) {
  std::map<std::pair<std::string, std::uint32_t>, std::pair<const Run*, const Track*>> tracks;
  for (const Run& run : set.runs) {
    for (const Track& track : run.tracks) tracks[{run.name, track.robot}] = {&run, &track};
  }
  std::vector<Window> windows;
  for (const Prediction& p : predictions) {
    const auto at = tracks.find({p.run, p.robot});
    if (at == tracks.end() || !std::isfinite(p.before_x_mm + p.before_y_mm + p.after_x_mm + p.after_y_mm)) continue;
    if (const auto window = window_of(*at->second.first, *at->second.second, p, horizon_s))
      windows.push_back(*window);
  }
  // Predictions are 5 s apart, so horizon_s / 5 of them overlap: the factor of the variance.
  const double overlap = std::max(1.0, horizon_s / 5);
  return {
      {"robots", robots(windows)}, {"maps", maps(windows)}, {"covariate_plots", covariate_plots(windows, overlap)}};
}

}  // namespace kilotwin::identify
