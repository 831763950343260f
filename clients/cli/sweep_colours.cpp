#include "clients/cli/sweep_colours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

std::string value_of(const std::string& set) { return set.substr(set.find('=') + 1); }

std::string fields_in_words(const SweepPoint& point) {
  std::string text;
  for (const std::string& set : point) text += field_of(set) + ", ";
  return text + SweepColours::kGroup;
}

PlotSeries series_of(const std::string& name) {
  PlotSeries series;
  series.name = name;
  return series;
}

}  // namespace

SweepColours::SweepColours(const std::vector<SweepPoint>& points, std::string by,
                           std::optional<std::size_t> response_field)
    : points_(points), by_(std::move(by)), response_field_(response_field) {
  if (by_group()) return;
  const SweepPoint& first = points_.front();
  const auto found =
      std::find_if(first.begin(), first.end(), [&](const auto& set) { return field_of(set) == by_; });
  if (found == first.end())
    throw UserError(fmt::format("--colour-by {}: is not swept; there are {}", by_, fields_in_words(first)));
  divide(static_cast<std::size_t>(found - first.begin()));
}

void SweepColours::divide(std::size_t field) {
  std::vector<std::string> names;
  std::vector<double> numbers;
  for (const SweepPoint& point : points_) {
    const std::string name = value_of(point[field]);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    if (const auto number = number_of(point[field])) numbers.push_back(*number);
  }
  if (names.size() <= kMostCurves) {
    for (const SweepPoint& point : points_)
      colour_of_.push_back(
          static_cast<std::size_t>(std::find(names.begin(), names.end(), value_of(point[field])) - names.begin()));
  } else if (numbers.size() == points_.size()) {
    constexpr std::size_t kRanges = 4;
    std::vector<double> sorted = numbers;
    std::sort(sorted.begin(), sorted.end());
    names.clear();
    std::vector<double> begins;
    for (std::size_t r = 0; r < kRanges; ++r) {
      const std::size_t begin = r * sorted.size() / kRanges, end = (r + 1) * sorted.size() / kRanges;
      begins.push_back(sorted[begin]);
      names.push_back(fmt::format("{:.3g} to {:.3g}", sorted[begin], sorted[end - 1]));
    }
    for (const double number : numbers)
      colour_of_.push_back(static_cast<std::size_t>(std::upper_bound(begins.begin() + 1, begins.end(), number) -
                                                    begins.begin() - 1));
  } else {
    throw UserError(fmt::format("--colour-by {}: has {} values; a plot shows at most {}, unless they are numbers",
                                by_, names.size(), kMostCurves));
  }
  for (std::string& name : names) colours_.push_back({std::move(name), {}, {}, {}});
}

void SweepColours::add(std::size_t point, std::size_t group, const ObservedCurve& curve) {
  if (by_group() && group >= kMostCurves) return;
  while (by_group() && colours_.size() <= group) colours_.push_back({std::to_string(colours_.size()), {}, {}, {}});
  Colour& colour = colours_.at(by_group() ? group : colour_of_[point]);
  if (curve.time_s.size() > colour.time_s.size()) colour.time_s = curve.time_s;
  colour.over_time.resize(colour.time_s.size());
  for (std::size_t i = 0; i < curve.value.size(); ++i) {
    if (std::isfinite(curve.value[i])) colour.over_time[i].add(curve.value[i]);
  }
  if (!response_field_ || curve.value.empty() || !std::isfinite(curve.value.back())) return;
  colour.at_end[*number_of(points_[point][*response_field_])].add(curve.value.back());
}

void SweepColours::add_curves(Plot& plot) const {
  plot.legend_title = by_;
  for (const Colour& colour : colours_) {
    PlotSeries series = series_of(colour.name);
    series.x = colour.time_s;
    for (const stats::Moments& sample : colour.over_time) {
      series.y.push_back(sample.count() > 0 ? sample.mean() : std::nan(""));
      series.error.push_back(sample.standard_error());
    }
    series.points = false;
    series.band = true;
    plot.series.push_back(std::move(series));
  }
}

void SweepColours::add_response(Plot& plot) const {
  plot.legend_title = by_;
  // Where each point has a value of its own, as in a Latin hypercube, the other fields scatter it: a line would mislead.
  std::set<std::string> values;
  for (const SweepPoint& point : points_) values.insert(point[*response_field_]);
  const bool scattered = points_.size() > 2 && values.size() == points_.size() && points_.front().size() > 1;
  for (const Colour& colour : colours_) {
    PlotSeries series = series_of(colour.name);
    series.line = !scattered || by_group();
    for (const auto& [x, sample] : colour.at_end) {
      series.x.push_back(x);
      series.y.push_back(sample.mean());
      series.error.push_back(sample.standard_error());
    }
    plot.series.push_back(std::move(series));
  }
}

bool have_equal_ratios(std::vector<double> numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  constexpr double kLeastSpan = 4, kOff = 0.02;
  if (numbers.size() < 3 || numbers.front() <= 0 || numbers.back() < kLeastSpan * numbers.front()) return false;
  const double step = std::log(numbers.back() / numbers.front()) / static_cast<double>(numbers.size() - 1);
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (std::abs(std::log(numbers[i] / numbers[i - 1]) - step) > kOff) return false;
  }
  return true;
}

}  // namespace kilotwin::cli
