#include "clients/track/edge_circle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "clients/track/brightness.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::track {
namespace {

constexpr double kInner = 0.55, kOuter = 1.5;  ///< part of the rays that is looked at, in radii
constexpr int kMostSamples = 96;
/// The fit's last steps look for edges within this share of the radius.
constexpr double kLeastTolerance = 0.16;
/// The fit ends when a step moves the centre and changes the radius by less than this, px: a quarter of the least error of a centre.
constexpr double kConverged_px = 0.004;

// Not std::hypot(), which is several times slower: coordinates of pixels do not overflow.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

/// Unit vectors of the rays.
struct Ray {
  double cos, sin;
};

const std::array<Ray, kRays>& rays() {
  static const std::array<Ray, kRays> table = [] {
    std::array<Ray, kRays> made{};
    for (int i = 0; i < kRays; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRays;
      made[static_cast<std::size_t>(i)] = {std::cos(angle), std::sin(angle)};
    }
    return made;
  }();
  return table;
}

/// Log brightness of the part of a picture around a circle, smoothed.
class Patch {
 public:
  Patch(const cv::Mat& grey, const Circle& guess) {
    const double reach = guess.radius_px * 1.85 + 4;
    const int left = static_cast<int>(std::floor(guess.centre.x_px - reach));
    const int top = static_cast<int>(std::floor(guess.centre.y_px - reach));
    const int side = static_cast<int>(std::ceil(2 * reach)) + 1;
    const cv::Rect inside = cv::Rect(left, top, side, side) & cv::Rect(0, 0, grey.cols, grey.rows);
    if (inside.width < 4 || inside.height < 4) return;
    origin_ = {static_cast<double>(inside.x), static_cast<double>(inside.y)};
    cv::LUT(grey(inside), log_table(), pixels_);
    const double sigma = std::max(0.6, 0.045 * guess.radius_px);
    cv::GaussianBlur(pixels_, pixels_, cv::Size(), sigma, sigma, cv::BORDER_REPLICATE);
    first_ = pixels_.ptr<float>();
    row_length_ = static_cast<int>(pixels_.step1());
    right_ = pixels_.cols - 1.001;
    bottom_ = pixels_.rows - 1.001;
  }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  /// Whether the point lies in the picture.
  [[nodiscard]] bool contains(double x, double y) const {
    x -= origin_.x_px;
    y -= origin_.y_px;
    return x >= 0 && y >= 0 && x <= pixels_.cols - 1 && y <= pixels_.rows - 1;
  }
  /// Bilinear; the nearest pixel's outside.
  [[nodiscard]] float at(double x, double y) const {
    x = std::clamp(x - origin_.x_px, 0.0, right_);
    y = std::clamp(y - origin_.y_px, 0.0, bottom_);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const auto u = static_cast<float>(x - column), v = static_cast<float>(y - row);
    const float* upper = first_ + row * row_length_ + column;
    const float* lower = upper + row_length_;
    return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
  }

 private:
  cv::Mat pixels_;
  const float* first_ = nullptr;
  int row_length_ = 0;
  double right_ = 0, bottom_ = 0;  ///< the last places between two pixels
  Point origin_;
};

struct EdgePoint {
  Point at;
  double rise = 0;      ///< of log brightness across the edge
  bool there = false;   ///< the ray meets an edge
  bool hidden = false;  ///< something bright or a neighbour hides the rim here
};

/// Looks along a ray for the strongest rise near the radius.
EdgePoint edge_on(const Patch& patch, const Circle& circle, const Ray& ray, double tolerance, double least_rise) {
  const double r = circle.radius_px;
  const double step = std::max(0.5, r / 20);
  const double from = std::max(kInner, 1 - tolerance - 0.2) * r, to = std::min(kOuter, 1 + tolerance + 0.2) * r;
  const int count = std::min(kMostSamples, static_cast<int>((to - from) / step) + 1);
  std::array<float, kMostSamples> values{};
  for (int i = 0; i < count; ++i) {
    const double at = from + i * step;
    values[static_cast<std::size_t>(i)] =
        patch.at(circle.centre.x_px + at * ray.cos, circle.centre.y_px + at * ray.sin);
  }
  // The rise over a span of some 0.2 radii: what the edge of a disc makes, blurred as it may be.
  const int half = std::max(1, static_cast<int>(std::lround(0.09 * r / step)));
  const auto rise_at = [&](int i) {
    const int before = i - half, after = i + half;
    return static_cast<double>(values[static_cast<std::size_t>(after)]) -
           static_cast<double>(values[static_cast<std::size_t>(before)]);
  };
  EdgePoint found;
  int best = -1;
  double best_weighted = 0;
  for (int i = half; i + half < count; ++i) {
    const double at = from + i * step;
    const double off = (at - r) / (r * tolerance);
    if (std::abs(off) > 1) continue;
    const double weighted = rise_at(i) * (1 - 0.5 * off * off);
    if (weighted > best_weighted) {
      best_weighted = weighted;
      best = i;
    }
  }
  if (best < 0) return found;
  found.rise = rise_at(best);
  double shift = 0;
  if (best > half && best + half + 1 < count) {
    const double before = rise_at(best - 1), after = rise_at(best + 1);
    const double bend = before - 2 * found.rise + after;
    if (bend < -1e-9) shift = std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
  }
  const double at = from + (best + shift) * step;
  found.at = {circle.centre.x_px + at * ray.cos, circle.centre.y_px + at * ray.sin};
  found.there = found.rise >= least_rise && patch.contains(found.at.x_px, found.at.y_px);
  if (found.there) {
    // The edge must run across the ray.
    const double side = std::max(1.0, 0.12 * r);
    const double along =
        static_cast<double>(patch.at(found.at.x_px + side * ray.cos, found.at.y_px + side * ray.sin)) -
        static_cast<double>(patch.at(found.at.x_px - side * ray.cos, found.at.y_px - side * ray.sin));
    const double across =
        static_cast<double>(patch.at(found.at.x_px - side * ray.sin, found.at.y_px + side * ray.cos)) -
        static_cast<double>(patch.at(found.at.x_px + side * ray.sin, found.at.y_px - side * ray.cos));
    found.there = along > 0 && std::abs(across) < 0.75 * along;
  }
  return found;
}

/// One step of the fit: the circle through weighted points, by Gauss and Newton.
Circle improved(const Circle& circle, const std::array<EdgePoint, kRays>& points) {
  std::vector<double> distances;
  for (const EdgePoint& p : points) {
    if (p.there)
      distances.push_back(
          std::abs(length_of(p.at.x_px - circle.centre.x_px, p.at.y_px - circle.centre.y_px) - circle.radius_px));
  }
  if (distances.size() < 8) return circle;
  // Tukey's weights, scaled by the median distance.
  const double bound = std::max(4.0 * 1.4826 * stats::upper_median(distances), 0.02 * circle.radius_px + 0.2);
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0, 0, 0);
  for (const EdgePoint& p : points) {
    if (!p.there) continue;
    const double dx = p.at.x_px - circle.centre.x_px, dy = p.at.y_px - circle.centre.y_px;
    const double length = length_of(dx, dy);
    const double off = length - circle.radius_px;
    if (std::abs(off) >= bound || length < 1e-9) continue;
    const double share = off / bound;
    const double weight = (1 - share * share) * (1 - share * share);
    const cv::Vec3d row(dx / length, dy / length, 1);
    normal += weight * (row * row.t());
    right += weight * off * row;
  }
  cv::Vec3d change;
  if (!cv::solve(normal, right, change, cv::DECOMP_CHOLESKY)) return circle;
  return {{circle.centre.x_px + change[0], circle.centre.y_px + change[1]}, circle.radius_px + change[2]};
}

/// Covariance of the centre and the radius, from the edge points that are on the circle; the centre's part.
cv::Matx22d spread_of(const std::vector<Point>& directions) {
  cv::Matx33d normal = cv::Matx33d::zeros();
  for (const Point& d : directions) {
    const cv::Vec3d row(d.x_px, d.y_px, 1);
    normal += row * row.t();
  }
  bool regular = false;
  const cv::Matx33d inverse = normal.inv(cv::DECOMP_CHOLESKY, &regular);
  if (!regular) return cv::Matx22d::eye();
  return {inverse(0, 0), inverse(0, 1), inverse(1, 0), inverse(1, 1)};
}

/// Marks the rays on which a neighbour or something brighter than the floor covers the rim.
void mark_hidden(std::array<EdgePoint, kRays>& points, const Patch& patch, const Circle& circle,
                 const std::vector<Circle>& neighbours) {
  const double r = circle.radius_px;
  std::array<float, kRays> outside{}, rim{};
  for (std::size_t i = 0; i < kRays; ++i) {
    const Ray& ray = rays()[i];
    outside[i] = patch.at(circle.centre.x_px + 1.3 * r * ray.cos, circle.centre.y_px + 1.3 * r * ray.sin);
    float most = -1e9F;
    for (const double at : {0.8, 0.9, 1.0})
      most = std::max(most, patch.at(circle.centre.x_px + at * r * ray.cos, circle.centre.y_px + at * r * ray.sin));
    rim[i] = most;
  }
  const float floor = stats::upper_median(std::vector<float>(outside.begin(), outside.end()));
  int bright = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    points[i].hidden = rim[i] > floor + 0.08F;
    bright += points[i].hidden ? 1 : 0;
  }
  // A lamp covers a part of the rim at most. More is no lamp.
  if (bright > kRays * 3 / 10) {
    for (EdgePoint& p : points) p.hidden = false;
  }
  for (const Circle& other : neighbours) {
    const double dx = other.centre.x_px - circle.centre.x_px, dy = other.centre.y_px - circle.centre.y_px;
    const double distance = length_of(dx, dy);
    if (distance < 0.5 * r || distance > 2.8 * r) continue;
    // Where the neighbour's disc comes closer to this one than a quarter of a radius, blur may close the gap.
    for (std::size_t i = 0; i < kRays; ++i) {
      const double x = 1.2 * r * rays()[i].cos - dx, y = 1.2 * r * rays()[i].sin - dy;
      if (length_of(x, y) < 1.1 * other.radius_px) points[i].hidden = true;
    }
  }
}

}  // namespace

std::optional<FittedCircle> fit_circle(const cv::Mat& grey, const Circle& guess, const FitLimits& limits) {
  const Patch patch(grey, guess);
  if (patch.empty() || guess.radius_px < 3) return std::nullopt;
  Circle circle = guess;
  std::array<EdgePoint, kRays> points;
  double tolerance = std::min(0.35, limits.radius_tolerance + 0.12);
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t i = 0; i < kRays; ++i)
      points[i] = edge_on(patch, circle, rays()[i], tolerance, limits.least_rise);
    const Circle next = improved(circle, points);
    const double least = guess.radius_px * (1 - limits.radius_tolerance);
    const double most = guess.radius_px * (1 + limits.radius_tolerance);
    const Circle before = circle;
    circle = {next.centre, std::clamp(next.radius_px, least, most)};
    if (length_of(circle.centre.x_px - guess.centre.x_px, circle.centre.y_px - guess.centre.y_px) >
        0.6 * guess.radius_px)
      return std::nullopt;
    const double change_px =
        length_of(circle.centre.x_px - before.centre.x_px, circle.centre.y_px - before.centre.y_px) +
        std::abs(circle.radius_px - before.radius_px);
    if (tolerance <= kLeastTolerance && change_px < kConverged_px) break;
    tolerance = std::max(kLeastTolerance, 0.7 * tolerance);
  }
  mark_hidden(points, patch, circle, limits.neighbours);
  FittedCircle fitted;
  fitted.circle = circle;
  std::vector<double> rises;
  std::vector<Point> directions;
  double squares = 0;
  int visible = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    const EdgePoint& p = points[i];
    const double off = length_of(p.at.x_px - circle.centre.x_px, p.at.y_px - circle.centre.y_px) - circle.radius_px;
    const bool on_circle = p.there && std::abs(off) < 0.07 * circle.radius_px + 0.3;
    if (on_circle || !p.hidden) ++visible;
    if (!on_circle) continue;
    rises.push_back(p.rise);
    directions.push_back({rays()[i].cos, rays()[i].sin});
    squares += off * off;
  }
  if (rises.size() < kRays / 4) return std::nullopt;
  fitted.seen = static_cast<double>(rises.size()) / kRays;
  fitted.coverage = static_cast<double>(rises.size()) / std::max(visible, kRays / 2);
  fitted.spread = spread_of(directions);
  fitted.residual_px = std::sqrt(squares / static_cast<double>(rises.size()));
  fitted.contrast = stats::upper_median(rises);
  return fitted;
}

}  // namespace kilotwin::track
