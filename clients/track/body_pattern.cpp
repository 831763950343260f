#include "clients/track/body_pattern.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// Radii of the rings, of the disc's: three on the battery, two on the board beside it. The rim itself may show the floor.
constexpr std::array<double, BodyPicture::kRings> kRingRadii{0.3, 0.45, 0.6, 0.8, 0.89};
constexpr double kStep_rad = 2 * kPi / BodyPicture::kAngles;
constexpr double kLeastBodyContrast = 0.02;  ///< root mean square of the logarithm

constexpr double kEnoughPictures = 60;
/// Length of the mean of the pictures, whose own length is 1, from which they have a pattern in common.
constexpr double kLeastCoherence = 0.3;
/// The mean of the learned headings' unit vectors is at most this long: beyond, lamps and shadows are a part of the pattern.
constexpr double kMostAlike = 0.7;
/// Old pictures lose weight beyond this count.
constexpr double kMostPictures = 20000;
/// Correlation at the best rotation, and by how much it exceeds that at rotations of more than 30 degrees from it.
constexpr double kLeastCorrelation = 0.35, kLeastLead = 0.1;
constexpr int kNearRotation = 6;  ///< steps, 30 degrees

double angle_of(std::size_t sample) { return static_cast<double>(sample) * kStep_rad; }

/// Bilinear, of a picture of 8 bits; nothing outside.
std::optional<double> brightness_at(const cv::Mat& grey, double x, double y) {
  const int column = cvFloor(x), row = cvFloor(y);
  if (column < 0 || row < 0 || column + 1 >= grey.cols || row + 1 >= grey.rows) return std::nullopt;
  const double u = x - column, v = y - row;
  const auto *upper = grey.ptr<unsigned char>(row) + column, *lower = grey.ptr<unsigned char>(row + 1) + column;
  return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
}

/// A ring at an angle between two of its samples.
double value_at(const BodyPicture::Ring& ring, double angle_rad) {
  const double at = angle_rad / kStep_rad, whole = std::floor(at), share = at - whole;
  constexpr auto kAll = static_cast<long>(BodyPicture::kAngles);
  const long left = ((static_cast<long>(whole) % kAll) + kAll) % kAll;
  return (1 - share) * ring[static_cast<std::size_t>(left)] +
         share * ring[static_cast<std::size_t>((left + 1) % kAll)];
}

}  // namespace

std::optional<BodyPicture> BodyPicture::of(const cv::Mat& grey, const Point& centre, const FloorMap& floor) {
  // Within a disc the map from the floor to the picture is linear.
  const FloorPoint middle = floor.floor(centre);
  const Point right = floor.pixel({middle.x_mm + kRobotRadius_mm, middle.y_mm});
  const Point up = floor.pixel({middle.x_mm, middle.y_mm + kRobotRadius_mm});
  BodyPicture picture;
  for (std::size_t angle = 0; angle < kAngles; ++angle) {
    const double c = std::cos(angle_of(angle)), s = std::sin(angle_of(angle));
    const double dx = c * (right.x_px - centre.x_px) + s * (up.x_px - centre.x_px);
    const double dy = c * (right.y_px - centre.y_px) + s * (up.y_px - centre.y_px);
    for (std::size_t ring = 0; ring < kRings; ++ring) {
      const auto value =
          brightness_at(grey, centre.x_px + kRingRadii[ring] * dx, centre.y_px + kRingRadii[ring] * dy);
      if (!value) return std::nullopt;
      picture.rings[ring][angle] = static_cast<float>(std::log(*value + 12));
    }
  }
  if (!picture.normalise()) return std::nullopt;
  return picture;
}

bool BodyPicture::normalise() {
  double squares = 0;
  for (Ring& ring : rings) {
    double sum = 0;
    for (const float value : ring) sum += value;
    for (float& value : ring) {
      value -= static_cast<float>(sum / kAngles);
      squares += static_cast<double>(value) * value;
    }
  }
  const double length = std::sqrt(squares);
  if (length < kLeastBodyContrast * std::sqrt(static_cast<double>(kRings * kAngles))) return false;
  for (Ring& ring : rings)
    for (float& value : ring) value /= static_cast<float>(length);
  return true;
}

void BodyPattern::learn(const BodyPicture& picture, double heading_rad) {
  if (count_ >= kMostPictures) {
    for (BodyPicture::Ring& ring : sum_)
      for (float& value : ring) value /= 2;
    for (double* const sum : {&count_, &cos_, &sin_}) *sum /= 2;
  }
  for (std::size_t ring = 0; ring < BodyPicture::kRings; ++ring) {
    for (std::size_t angle = 0; angle < BodyPicture::kAngles; ++angle)
      sum_[ring][angle] += static_cast<float>(value_at(picture.rings[ring], angle_of(angle) + heading_rad));
  }
  count_ += 1;
  cos_ += std::cos(heading_rad);
  sin_ += std::sin(heading_rad);
}

std::optional<double> BodyPattern::heading_rad(const BodyPicture& picture) const {
  if (count_ < kEnoughPictures || std::hypot(cos_, sin_) > kMostAlike * count_) return std::nullopt;
  constexpr std::size_t kAll = BodyPicture::kAngles;
  double squares = 0;
  std::array<double, kAll> agreement{};
  for (std::size_t ring = 0; ring < BodyPicture::kRings; ++ring) {
    // Twice in a row, so that a rotation is a shift.
    std::array<float, 2 * kAll> seen;
    std::copy(picture.rings[ring].begin(), picture.rings[ring].end(), seen.begin());
    std::copy(picture.rings[ring].begin(), picture.rings[ring].end(), seen.begin() + kAll);
    for (const float value : sum_[ring]) squares += static_cast<double>(value) * value;
    for (std::size_t turn = 0; turn < kAll; ++turn) {
      float sum = 0;
      for (std::size_t angle = 0; angle < kAll; ++angle) sum += sum_[ring][angle] * seen[angle + turn];
      agreement[turn] += sum;
    }
  }
  const auto best =
      static_cast<std::size_t>(std::max_element(agreement.begin(), agreement.end()) - agreement.begin());
  const double length = std::sqrt(squares);
  if (length < kLeastCoherence * count_) return std::nullopt;
  double second = -length;
  for (int off = kNearRotation; off <= static_cast<int>(kAll) - kNearRotation; ++off)
    second = std::max(second, agreement[(best + static_cast<std::size_t>(off)) % kAll]);
  if (agreement[best] < kLeastCorrelation * length || agreement[best] - second < kLeastLead * length)
    return std::nullopt;
  // The top of the parabola through the best rotation and its neighbours.
  const double left = agreement[(best + kAll - 1) % kAll], right = agreement[(best + 1) % kAll];
  const double bend = left - 2 * agreement[best] + right;
  const double shift = bend < 0 ? 0.5 * (left - right) / bend : 0;
  return wrapped((static_cast<double>(best) + shift) * kStep_rad);
}

}  // namespace kilotwin::track
