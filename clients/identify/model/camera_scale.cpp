#include "clients/identify/model/camera_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

// Range of pair distances, mm: one disc diameter and the largest scale error of a camera map about it. Histogram
// bin, mm.
constexpr double kLow_mm = 24, kHigh_mm = 48, kBin_mm = 0.1;
constexpr std::size_t kBins = 240;
/// Tolerance of the disc diameter, mm: discs are not exactly round, and legs lean.
constexpr double kMade_mm = 0.3;
/// Sampling interval of pairs.
constexpr double kEvery_s = 0.5;

/// Probability of each histogram bin: a mixture of robots that pass each other, none nearer than `edge`, and
/// robots in contact.
struct Shares {
  std::array<double, kBins> passing{}, staying{};
  Shares(double edge_mm, double sd_mm) {
    double all = 0, near = 0;
    for (std::size_t i = 0; i < kBins; ++i) {
      const double low = kLow_mm + kBin_mm * static_cast<double>(i), d = low + kBin_mm / 2;
      all += passing[i] = d * stats::normal_cdf((d - edge_mm) / sd_mm);
      near += staying[i] =
          stats::normal_cdf((low + kBin_mm - edge_mm) / sd_mm) - stats::normal_cdf((low - edge_mm) / sd_mm);
    }
    for (std::size_t i = 0; i < kBins; ++i) {
      passing[i] /= all;
      staying[i] /= std::max(near, 1e-300);
    }
  }
};

/// Coefficients of the camera map's columns that are linear along their own axis, for x and for y; null if the map
/// lacks them.
struct LinearMap {
  double *x = nullptr, *y = nullptr;
  const Factor* of = nullptr;
};

LinearMap linear_map_of(Term& term) {
  LinearMap map;
  Eigen::Index first = 0;
  for (const Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    const bool x = block.target == Target::kMeasuredX, y = block.target == Target::kMeasuredY;
    if ((x || y) && block.basis.factors.size() == 1 && block.basis.factors.front().shape == Shape::kPolynomials2) {
      // The first column is P1(x), the second P1(y).
      const std::uint32_t wanted = x ? 0 : 1;
      for (Eigen::Index i = 0; i < n; ++i) {
        const std::uint32_t column = block.basis.chosen.empty() ? static_cast<std::uint32_t>(i)
                                                                : block.basis.chosen[static_cast<std::size_t>(i)];
        if (column == wanted) (x ? map.x : map.y) = term.coefficients.data() + first + i;
      }
      map.of = &block.basis.factors.front();
    }
    first += n;
  }
  return map;
}

}  // namespace

void add_pairs(const RunNeighbours& run, std::size_t robots, std::uint32_t number, std::vector<RobotPair>& to) {
  // Gap after which two robots meet anew; a shorter one counts one encounter as several.
  constexpr double kAnew_s = 5;
  const auto stride = static_cast<std::size_t>(kEvery_s / RunNeighbours::kRaster_s);
  std::size_t encounter = to.empty() ? 0 : to.back().encounter;
  for (std::size_t a = 0; a < robots; ++a) {
    for (std::size_t b = a + 1; b < robots; ++b) {
      double last_s = -1e300;
      for (std::size_t i = 0; i < run.instants(); i += stride) {
        const RunNeighbours::Spot &one = run.spot(a, i), &other = run.spot(b, i);
        const double apart = std::hypot(one.x_mm - other.x_mm, one.y_mm - other.y_mm);
        if (!(apart > kLow_mm && apart < kHigh_mm)) continue;
        if (run.time_s(i) > last_s + kAnew_s) ++encounter;
        last_s = run.time_s(i);
        RobotPair& pair = to.emplace_back();
        pair.distance_mm = apart;
        pair.encounter = encounter;
        pair.x_mm = (one.x_mm + other.x_mm) / 2;
        pair.y_mm = (one.y_mm + other.y_mm) / 2;
        pair.at.time_s = last_s;
        pair.at.run = number;
      }
    }
  }
}

std::optional<ContactDistance> contact_distance(const std::vector<RobotPair>& pairs) {
  constexpr std::size_t kFewest = 12;  // encounters; with fewer, no contact distance is stated
  std::array<double, kBins> counts{};
  std::size_t encounters = 0, last = 0;
  for (const RobotPair& pair : pairs) {
    const double at = (pair.distance_mm - kLow_mm) / kBin_mm;
    if (!(at >= 0 && at < kBins)) continue;
    counts[static_cast<std::size_t>(at)] += 1;
    if (pair.encounter != last) ++encounters;
    last = pair.encounter;
  }
  if (encounters < kFewest) return std::nullopt;
  double all = 0;
  for (const double count : counts) all += count;
  // Instants of one encounter count as one observation.
  const double weight = static_cast<double>(encounters) / all;
  const auto log_likelihood = [&](const Shares& shares, double staying) {
    double sum = 0;
    for (std::size_t i = 0; i < kBins; ++i)
      if (counts[i] > 0)
        // Floor of the probability: some pairs follow no model.
        sum += counts[i] *
               std::log(0.98 * ((1 - staying) * shares.passing[i] + staying * shares.staying[i]) + 0.02 / kBins);
    return weight * sum;
  };
  // Null hypothesis: robots do not touch.
  const double nothing = log_likelihood(Shares(-100, 1), 0);
  struct Tried {
    double edge_mm, value;
  };
  std::vector<Tried> tried;
  // Edges that are tried, so far within the counted distances that some lie on either side. Wider bounds would fit edges to
  // a few pairs.
  constexpr double kFirst_mm = kLow_mm + 3, kLast_mm = kHigh_mm - 6;
  const auto edges = static_cast<int>(std::ceil((kLast_mm - kFirst_mm) / kBin_mm));
  for (int i = 0; i < edges; ++i) {
    const double edge = kFirst_mm + i * kBin_mm;
    double best = -1e300;
    for (const double sd : {0.3, 0.5, 0.8, 1.2, 1.8, 2.7}) {
      const Shares shares(edge, sd);
      for (const double staying : {0.1, 0.25, 0.4, 0.55, 0.7, 0.85})
        best = std::max(best, log_likelihood(shares, staying));
    }
    tried.push_back({edge, best});
  }
  const Tried best = *std::max_element(tried.begin(), tried.end(),
                                       [](const Tried& a, const Tried& b) { return a.value < b.value; });
  constexpr double kSure = 12;  // nat over robots that do not touch; a smaller value takes chance for contacts
  if (best.value < nothing + kSure) return std::nullopt;
  double sum = 0, mean = 0, square = 0;
  for (const Tried& t : tried) {
    const double chance = std::exp(t.value - best.value);
    sum += chance;
    mean += chance * t.edge_mm;
    square += chance * t.edge_mm * t.edge_mm;
  }
  mean /= sum;
  return ContactDistance{mean, std::sqrt(std::max(0.0, square / sum - mean * mean) + kMade_mm * kMade_mm),
                         encounters};
}

ScaleConstraint::ScaleConstraint(const MotionModel& model, const std::vector<RobotPair>& pairs, double relative_sd)
    : relative_sd_(relative_sd) {
  constexpr std::size_t kMost = 300;  // pairs, at most about; more cost time for each model that is tried
  const std::size_t every = pairs.size() / kMost + 1;
  for (std::size_t i = 0; i < pairs.size(); i += every) {
    for (const bool along_x : {true, false}) {
      Span& span = spans_.emplace_back();
      span.at = pairs[i].at;
      for (const int end : {0, 1}) {
        const double off = (end - 0.5) * kDiscDiameter_mm;
        const Eigen::Vector3d seen =
            model.measured(pairs[i].x_mm + (along_x ? off : 0), pairs[i].y_mm + (along_x ? 0 : off), 0, span.at);
        span.x_mm[end] = seen[0];
        span.y_mm[end] = seen[1];
      }
    }
  }
  then_ = log_length(model);
}

double ScaleConstraint::log_length(const MotionModel& model) const {
  double sum = 0;
  for (const Span& span : spans_) {
    Eigen::Vector3d ends[2];
    for (const int end : {0, 1})
      ends[end] = model.pose_of({span.at.time_s, span.x_mm[end], span.y_mm[end], std::nan("")}, span.at);
    sum += std::log(std::max(1.0, (ends[0] - ends[1]).head<2>().norm()));
  }
  return spans_.empty() ? 0 : sum / static_cast<double>(spans_.size());
}

double ScaleConstraint::factor(const MotionModel& model) const { return std::exp(then_ - log_length(model)); }

Walls carried(const Walls& walls, const MotionModel& before, const MotionModel& after) {
  // Half-length of the span used if the opposite side has no wall, from the middle of the image.
  constexpr double kSide_mm = 250;
  constexpr std::array<double, 5> kAlong = {0.1, 0.3, 0.5, 0.7, 0.9};
  const auto range = [&](double low, double high) {
    if (std::isfinite(low) && std::isfinite(high)) return std::pair{low, high};
    if (std::isfinite(low)) return std::pair{low, low + 2 * kSide_mm};
    if (std::isfinite(high)) return std::pair{high - 2 * kSide_mm, high};
    return std::pair{-kSide_mm, kSide_mm};
  };
  const std::pair<double, double> in_x = range(walls.x_low_mm, walls.x_high_mm),
                                  in_y = range(walls.y_low_mm, walls.y_high_mm);
  // Compares disc centres, whichever point of the robot is tracked.
  const auto of_centres = [](MotionModel model) {
    model.base.ahead_mm = model.base.centre_mm = model.base.left_mm = 0;
    return model;
  };
  const MotionModel then = of_centres(before), now = of_centres(after);
  const auto moved = [&](double x_mm, double y_mm) {
    const Situation at;
    const Eigen::Vector3d seen = then.measured(x_mm, y_mm, 0, at);
    return Eigen::Vector2d(now.pose_of({0, seen[0], seen[1], std::nan("")}, at).head<2>());
  };
  Walls out = walls;
  const auto carry = [&](double Walls::*side, bool of_x) {
    if (std::isinf(walls.*side)) return;
    double sum = 0;
    for (const double part : kAlong) {
      const auto& [low, high] = of_x ? in_y : in_x;
      const double along = low + part * (high - low);
      sum += of_x ? moved(walls.*side, along)[0] : moved(along, walls.*side)[1];
    }
    out.*side = sum / static_cast<double>(kAlong.size());
  };
  carry(&Walls::x_low_mm, true);
  carry(&Walls::x_high_mm, true);
  carry(&Walls::y_low_mm, false);
  carry(&Walls::y_high_mm, false);
  return out;
}

Eigen::VectorXd log_scale_by_coefficients(const MotionModel& model) {
  MotionModel copy = model;
  Eigen::Index columns = 0;
  for (const Term& term : copy.terms) columns += term.coefficients.size();
  Eigen::VectorXd by(0);
  Eigen::Index first = 0;
  for (Term& term : copy.terms) {
    const LinearMap map = linear_map_of(term);
    if (map.x != nullptr && map.y != nullptr) {
      by.setZero(columns);
      by[first + (map.x - term.coefficients.data())] = 1 / (map.of->high - map.of->low);
      by[first + (map.y - term.coefficients.data())] = 1 / (map.of->and_high - map.of->and_low);
    }
    first += term.coefficients.size();
  }
  return by;
}

namespace {

/// Widens what a factor knows of places and distances. The phases of waves are left to the next fit.
void widen(Factor& f, double factor, double middle_x_mm, double middle_y_mm) {
  const auto widen_range = [&](const Axis& axis, double& low, double& high, std::vector<double>* points) {
    double middle = 0;
    switch (axis.of) {
      case Covariate::kX: middle = middle_x_mm; break;
      case Covariate::kY: middle = middle_y_mm; break;
      case Covariate::kAlong:
        middle = middle_x_mm * std::cos(axis.along_rad) + middle_y_mm * std::sin(axis.along_rad);
        break;
      case Covariate::kRadius:
      case Covariate::kPointDistance: break;
      default: return;
    }
    const auto wider = [&](double& at) { at = middle + factor * (at - middle); };
    wider(low);
    wider(high);
    if (points == nullptr) return;
    if (f.shape == Factor::Shape::kAtLeast)
      for (double& at : *points) wider(at);
    else if (f.shape == Factor::Shape::kWave || f.shape == Factor::Shape::kExponential ||
             f.shape == Factor::Shape::kLevelling)
      for (double& length_mm : *points) length_mm *= factor;
  };
  widen_range(f.axis, f.low, f.high, f.of_two() ? nullptr : &f.points);
  if (f.of_two()) widen_range(f.and_axis, f.and_low, f.and_high, nullptr);
  if (f.shape == Factor::Shape::kTravelling) {
    f.points[0] /= factor;
    f.points[1] /= factor;
  }
  if (f.axis.of == Covariate::kPointDistance) {
    MovingPoint& point = f.axis.point;
    point.x_mm = middle_x_mm + factor * (point.x_mm - middle_x_mm);
    point.y_mm = middle_y_mm + factor * (point.y_mm - middle_y_mm);
    for (double* const speed_mm_s : {&point.velocity_x_mm_s, &point.velocity_y_mm_s, &point.growth_mm_s})
      *speed_mm_s *= factor;
  }
}

}  // namespace

bool rescale(MotionModel& model, double factor) {
  MotionModel scaled = model;
  LinearMap map;
  for (Term& term : scaled.terms) {
    const LinearMap own = linear_map_of(term);
    if (own.x != nullptr && own.y != nullptr) map = own;
  }
  if (map.of == nullptr) return false;
  const double middle_x = (map.of->low + map.of->high) / 2, middle_y = (map.of->and_low + map.of->and_high) / 2;
  const auto wider = [factor](double& at, double middle) { at = middle + factor * (at - middle); };
  for (Term& term : scaled.terms) {
    Eigen::Index first = 0;
    for (Block& block : term.blocks) {
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      for (Factor& f : block.basis.factors) widen(f, factor, middle_x, middle_y);
      switch (block.target) {
        case Target::kOffset:
        case Target::kOffsetLeft:
        case Target::kOffsetRight:
        case Target::kAhead:
        case Target::kSideways:
        case Target::kWorldX:
        case Target::kWorldY:
          term.coefficients.segment(first, n) *= factor;
          term.precision.segment(first, n) /= factor * factor;
          break;
        default: break;
      }
      first += n;
    }
  }
  // The camera image keeps its size.
  *map.x += (1 / factor - 1) * (map.of->high - map.of->low) / 2;
  *map.y += (1 / factor - 1) * (map.of->and_high - map.of->and_low) / 2;
  BaseParameters& base = scaled.base;
  for (double* const length : {&base.straight_mm_s, &base.turn_mm_s, &base.wheel_base_mm, &base.ahead_mm,
                               &base.left_mm, &base.bias_mean_mm_s, &base.bias_sd_mm_s})
    *length *= factor;
  for (auto& [robot, bias] : scaled.robots) {
    bias.mean_mm_s *= factor;
    bias.covariance *= factor * factor;
  }
  scaled.noise.wheel_mm2_s *= factor * factor;
  scaled.noise.drift_mm2_s *= factor * factor;
  wider(scaled.walls.x_low_mm, middle_x);
  wider(scaled.walls.x_high_mm, middle_x);
  wider(scaled.walls.y_low_mm, middle_y);
  wider(scaled.walls.y_high_mm, middle_y);
  // Assigned in place: callers hold references to a term.
  model = scaled;
  return true;
}

}  // namespace kilotwin::identify
