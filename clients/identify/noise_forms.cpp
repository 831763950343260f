#include "clients/identify/noise_forms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include "clients/identify/model/effect_records.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using Samples = std::vector<NoiseSample>;

std::vector<std::size_t> folds_by_robot(const Samples& samples) {
  std::map<std::uint32_t, std::size_t> number;
  for (const NoiseSample& sample : samples) number.emplace(sample.robot, 0);
  std::size_t next = 0;
  for (auto& [robot, at] : number) at = next++ % NoiseForm::kFolds;
  std::vector<std::size_t> folds;
  for (const NoiseSample& sample : samples) folds.push_back(number[sample.robot]);
  return folds;
}

NoiseForm of_robots(const Samples& samples) {
  NoiseForm out{"noise-by-robot", {"robot"}, "robot", {}, {}, {}};
  std::map<std::uint32_t, Eigen::Index> column;
  for (const NoiseSample& sample : samples) column.emplace(sample.robot, 0);
  Eigen::Index next = 0;
  std::vector<std::uint32_t> robots;
  for (auto& [robot, at] : column) {
    at = next++;
    robots.push_back(robot);
  }
  out.columns = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(samples.size()), next);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    out.columns(static_cast<Eigen::Index>(i), column[samples[i].robot]) = 1;
    out.folds.push_back((stretch_of(samples[i]) + samples[i].track) % NoiseForm::kFolds);
  }
  out.scale = [robots](const Eigen::VectorXd& coefficients, double level) {
    proto::Function f;
    f.set_of(proto::Function::ROBOT);
    f.mutable_table()->set_otherwise(rounded(std::exp(0.5 * level)));
    for (std::size_t r = 0; r < robots.size(); ++r) {
      f.mutable_table()->add_key(robots[r]);
      f.mutable_table()->add_value(rounded(std::exp(0.5 * (level + coefficients[static_cast<Eigen::Index>(r)]))));
    }
    return f;
  };
  return out;
}

/// The range of a coordinate.
template <class Of> std::pair<double, double> range_of(const Samples& samples, Of&& of) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end(),
                                               [&](const auto& a, const auto& b) { return of(a) < of(b); });
  constexpr double kLeastRange = 1e-9;  // keeps the share of the range finite for data at one point
  return {of(*low), std::max(of(*high), of(*low) + kLeastRange)};
}

/// cos(k pi u) at the share u of a range.
double cosine(int k, double value, std::pair<double, double> range) {
  return std::cos(k * M_PI * std::clamp((value - range.first) / (range.second - range.first), 0.0, 1.0));
}

/// Largest order of the cosines: features of a quarter of a run, and of a third of the floor. A further order costs one
/// column over time and five over the place.
constexpr int kTimeOrder = 4, kPlaceOrder = 3;

NoiseForm of_time(const Samples& samples) {
  NoiseForm out{"noise-by-time", {"time"}, "time", {}, folds_by_robot(samples), {}};
  const auto range = range_of(samples, [](const NoiseSample& s) { return s.time_s; });
  const auto row = [range](double time_s) {
    Eigen::RowVectorXd r(kTimeOrder + 1);
    for (int k = 0; k <= kTimeOrder; ++k) r[k] = cosine(k, time_s, range);
    return r;
  };
  out.columns.resize(static_cast<Eigen::Index>(samples.size()), kTimeOrder + 1);
  for (std::size_t i = 0; i < samples.size(); ++i)
    out.columns.row(static_cast<Eigen::Index>(i)) = row(samples[i].time_s);
  out.scale = [row, range](const Eigen::VectorXd& coefficients, double level) {
    constexpr int kKnots = 25;  // six per half wave of the highest order, so that the spline follows the cosines
    proto::Function f;
    f.set_of(proto::Function::TIME);
    for (int i = 0; i < kKnots; ++i) {
      const double time_s = range.first + (range.second - range.first) * i / (kKnots - 1);
      f.mutable_spline()->add_knot(rounded(time_s));
      f.mutable_spline()->add_value(rounded(std::exp(0.5 * (level + row(time_s).dot(coefficients)))));
    }
    return f;
  };
  return out;
}

NoiseForm of_place(const Samples& samples) {
  NoiseForm out{"noise-by-place", {"position"}, "place", {}, folds_by_robot(samples), {}};
  const auto xs = range_of(samples, [](const NoiseSample& s) { return s.x_mm; });
  const auto ys = range_of(samples, [](const NoiseSample& s) { return s.y_mm; });
  const auto row = [xs, ys](double x_mm, double y_mm) {
    std::vector<double> values;
    for (int j = 0; j <= kPlaceOrder; ++j)
      for (int k = 0; j + k <= kPlaceOrder; ++k) values.push_back(cosine(j, x_mm, xs) * cosine(k, y_mm, ys));
    return Eigen::RowVectorXd(
        Eigen::Map<const Eigen::RowVectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  out.columns.resize(static_cast<Eigen::Index>(samples.size()), row(0, 0).size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    out.columns.row(static_cast<Eigen::Index>(i)) = row(samples[i].x_mm, samples[i].y_mm);
  out.scale = [row, xs, ys](const Eigen::VectorXd& coefficients, double level) {
    constexpr int kKnots = 13;  // along each axis, four per half wave of the highest order
    proto::Function f;
    f.set_of(proto::Function::X);
    f.set_and_of(proto::Function::Y);
    const auto knot = [](std::pair<double, double> range, int i) {
      return range.first + (range.second - range.first) * i / (kKnots - 1);
    };
    for (int i = 0; i < kKnots; ++i) {
      f.mutable_spline_2d()->add_knot(rounded(knot(xs, i)));
      f.mutable_spline_2d()->add_and_knot(rounded(knot(ys, i)));
    }
    for (int j = 0; j < kKnots; ++j)
      for (int i = 0; i < kKnots; ++i)
        f.mutable_spline_2d()->add_value(
            rounded(std::exp(0.5 * (level + row(knot(xs, i), knot(ys, j)).dot(coefficients)))));
    return f;
  };
  return out;
}

/// A covariate of neighbours: its range in the data, and the columns over it.
struct NeighbourCurve {
  Axis axis;
  double least, most;

  /// The value at which 1 / e of the rise of sums over neighbours is left.
  [[nodiscard]] double level() const { return std::max(1.0, most / 4); }
  /// Share of the range. Sums over neighbours level off, since few samples have many neighbours.
  [[nodiscard]] double share(double value) const {
    const double v = std::clamp(value, least, most);
    return axis.of == Covariate::kNearest ? (v - least) / (most - least)
                                          : std::expm1(-v / level()) / std::expm1(-most / level());
  }
  [[nodiscard]] double at_share(double share) const {
    if (share >= 1) return most;
    return axis.of == Covariate::kNearest ? least + share * (most - least)
                                          : -level() * std::log1p(share * std::expm1(-most / level()));
  }
  [[nodiscard]] Eigen::RowVectorXd row(double value) const {
    constexpr int kOrder = 3;  // as over the place
    Eigen::RowVectorXd r(kOrder + 1);
    for (int k = 0; k <= kOrder; ++k) r[k] = std::cos(k * M_PI * share(value));
    return r;
  }
};

/// The form over one covariate of neighbours; none if the data do not cover a range of it.
std::optional<NoiseForm> of_neighbours(const Samples& samples, const Axis& axis) {
  // Samples beyond each end of the range: the columns do not stretch to few outlying values.
  constexpr std::size_t kFewestBeyond = 30;
  // Largest distance, mm: without a neighbour it is far larger, and all radii end below.
  constexpr double kFarthest_mm = 1e3;
  std::vector<double> values;
  for (const NoiseSample& sample : samples) values.push_back(std::min(value_of(axis, sample.at, 0), kFarthest_mm));
  std::vector<double> reordered = values;
  const std::size_t ends = std::min(kFewestBeyond, values.size() / 2);
  const bool distance = axis.of == Covariate::kNearest;
  const NeighbourCurve curve{axis, distance ? stats::order_statistic(reordered, ends) : 0,
                             distance ? reach_mm(axis) : stats::upper_end(reordered, ends)};
  constexpr double kLeastRange = 0.1;  // a tenth of a robot, or of a mm; below, the data hold no neighbours
  if (!(curve.most > curve.least + kLeastRange)) return std::nullopt;
  NoiseForm out{"noise-by-neighbours", {"neighbours"}, {}, {}, folds_by_robot(samples), {}};
  out.in_words = fmt::format("{}{} within {:.0f} mm",
                             axis.of == Covariate::kNearest      ? "the distance of the nearest robot"
                             : axis.of == Covariate::kNeighbours ? "the number of robots"
                                                                 : "the density of robots",
                             axis.others == Others::kDriven ? " that drive" : "", reach_mm(axis));
  out.columns.resize(static_cast<Eigen::Index>(samples.size()), curve.row(0).size());
  for (std::size_t i = 0; i < samples.size(); ++i)
    out.columns.row(static_cast<Eigen::Index>(i)) = curve.row(values[i]);
  out.scale = [curve](const Eigen::VectorXd& coefficients, double level) {
    constexpr int kKnots = 13;  // four per half wave of the highest order
    proto::Function f = function_of(curve.axis);
    for (int i = 0; i < kKnots; ++i) {
      const double value = curve.at_share(static_cast<double>(i) / (kKnots - 1));
      f.mutable_spline()->add_knot(rounded(value));
      f.mutable_spline()->add_value(rounded(std::exp(0.5 * (level + curve.row(value).dot(coefficients)))));
    }
    return f;
  };
  return out;
}

/// Covariates of neighbours that compete: crowding, number, nearness; of all others, and of those that drive.
std::vector<Axis> neighbour_axes() {
  std::vector<Axis> axes;
  const auto add = [&](Covariate of, std::initializer_list<float> radii_mm, Others others) {
    for (const float radius_mm : radii_mm) {
      Axis axis{of};
      axis.within_mm = radius_mm;
      axis.others = others;
      axes.push_back(axis);
    }
  };
  add(Covariate::kDensity, {60, 80, 100, 130, 160}, Others::kAny);
  add(Covariate::kNeighbours, {70, 100, 140}, Others::kAny);
  add(Covariate::kNearest, {80, 120, 160}, Others::kAny);
  add(Covariate::kDensity, {80, 130}, Others::kDriven);
  return axes;
}

}  // namespace

std::size_t stretch_of(const NoiseSample& sample) {
  return static_cast<std::size_t>(std::max(0.0, sample.time_s) / kNoiseStretch_s);
}

std::vector<NoiseForm> noise_forms(const std::vector<NoiseSample>& samples) {
  std::vector<NoiseForm> forms{of_robots(samples), of_time(samples), of_place(samples)};
  for (const Axis& axis : neighbour_axes())
    if (std::optional<NoiseForm> form = of_neighbours(samples, axis)) forms.push_back(std::move(*form));
  return forms;
}

}  // namespace kilotwin::identify
