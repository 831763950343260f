#include "clients/track/led.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "core/stats/quantiles.hpp"

namespace kilotwin::track {
namespace {

constexpr double kOuter = 1.35;                      ///< the spot's light reaches that far from the centre, radii
constexpr double kFloorFrom = 1.35, kFloorTo = 1.8;  ///< the ring in which the floor is seen, radii
constexpr double kGridRadius = 8;  ///< larger discs are looked at with every second pixel, or fewer
constexpr double kSpot = 0.32;     ///< radius of the window that a spot fills, radii
/// Excess over the floor and difference of the channels, relative to the floor, above which a pixel is lit.
constexpr double kLeastExcess = 0.15, kLeastChroma = 0.16;
/// The dark rim, radii, and the brightness relative to the floor above which it is lit.
constexpr double kRimFrom = 0.72, kRimTo = 0.95, kBrightRim = 0.8;
/// Sum of what is above these, relative to the area of a window, above which there is a spot.
constexpr double kLeastLight = 0.10;
/// A second channel with this share of the strongest one belongs to the colour.
constexpr double kMixed = 0.5;
/// No class is clear if the centre of another robot is nearer than this, radii: its light may be taken for this robot's.
constexpr double kAlone = 3.0;
/// A class is clear below this share of the second channel; and above, or below, these multiples of the least light.
constexpr double kPure = 0.3, kClearlyLit = 2, kClearlyDark = 0.5;
/// Where even the weakest one has this share, the light is white.
constexpr double kGrey = 0.7;
/// The floor is looked at no farther from the centre than this, radii, and places so close to another robot's centre are no floor.
constexpr double kFarthestFloor = 3.0, kCovered = 1.25;
/// Light that rises across the border to another robot, to more than this multiple, is the other's. So many windows are looked at.
constexpr double kSpill = 1.5;
constexpr int kClimb = 8, kTries = 3;
constexpr double kClipped = 246;  ///< grey level above which a pixel counts as saturated

using Colour = std::array<double, 3>;  // red, green, blue

Colour pixel(const cv::Mat& picture, int row, int column) {
  if (picture.channels() == 1) {
    const double v = picture.at<unsigned char>(row, column);
    return {v, v, v};
  }
  const auto& p = picture.at<cv::Vec3b>(row, column);
  return {static_cast<double>(p[2]), static_cast<double>(p[1]), static_cast<double>(p[0])};
}

double distance(double x, double y, const Circle& c) {
  const double dx = x - c.centre.x_px, dy = y - c.centre.y_px;
  return std::sqrt(dx * dx + dy * dy);
}

/// The floor's colour around a robot: the median of each channel, of places that no robot covers.
Colour floor_around(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others) {
  std::array<std::vector<double>, 3> seen;
  const double r = disc.radius_px;
  constexpr int kAngles = 72, kRadii = 3;
  for (int pass = 0; pass < 2 && seen[0].size() < kAngles / 4; ++pass) {
    const double from = pass == 0 ? kFloorFrom : kFloorTo, to = pass == 0 ? kFloorTo : kFarthestFloor;
    for (int i = 0; i < kAngles * kRadii; ++i) {
      const double at = r * (from + (to - from) * (i % kRadii) / (kRadii - 1));
      const double angle = 2 * CV_PI * (i / kRadii) / kAngles;
      const double x = disc.centre.x_px + at * std::cos(angle), y = disc.centre.y_px + at * std::sin(angle);
      const int column = cvRound(x), row = cvRound(y);
      if (column < 0 || row < 0 || column >= picture.cols || row >= picture.rows) continue;
      if (std::any_of(others.begin(), others.end(),
                      [&](const Circle& o) { return distance(x, y, o) < kCovered * o.radius_px; }))
        continue;
      const Colour c = pixel(picture, row, column);
      for (std::size_t k = 0; k < 3; ++k) seen[k].push_back(c[k]);
    }
  }
  Colour floor{};
  for (std::size_t k = 0; k < 3; ++k) {
    // Crowded: the brightest of what there is was hardly a robot.
    if (seen[k].empty()) return {160, 160, 160};
    floor[k] = std::max(12.0, stats::upper_median(std::move(seen[k])));
  }
  return floor;
}

/// The light of one robot's surroundings, relative to the floor: a grid of some 20 x 20 pixels.
struct Light {
  int left, top, stride, columns, rows;
  std::vector<Colour> relative;  ///< pixel / floor
  std::vector<double> weight;    ///< how much of the pixel is light of an LED; 0 where another robot is nearer
  std::vector<double> anyones;   ///< the same whoever is nearer
  std::vector<bool> clipped;     ///< the camera is saturated: there is no colour

  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
};

Light light_around(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& others) {
  const Colour floor = floor_around(picture, disc, others);
  const double reach = kOuter * disc.radius_px;
  const int left = std::max(0, cvFloor(disc.centre.x_px - reach));
  const int top = std::max(0, cvFloor(disc.centre.y_px - reach));
  const int right = std::min(picture.cols - 1, cvCeil(disc.centre.x_px + reach));
  const int bottom = std::min(picture.rows - 1, cvCeil(disc.centre.y_px + reach));
  const int stride = std::max(1, cvRound(disc.radius_px / kGridRadius));
  Light light{
      left, top, stride, std::max(0, (right - left) / stride + 1), std::max(0, (bottom - top) / stride + 1), {},
      {},   {},  {}};
  const auto count = static_cast<std::size_t>(light.columns) * static_cast<std::size_t>(light.rows);
  light.relative.assign(count, Colour{});
  light.weight.assign(count, 0);
  light.anyones.assign(count, 0);
  light.clipped.assign(count, false);
  std::size_t i = 0;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.columns; ++x, ++i) {
      const int row = top + y * stride, column = left + x * stride;
      const double own = distance(column, row, disc) / disc.radius_px;
      if (own > kOuter) continue;
      double nearest = own;  // distance from the middle of the robot that is nearest, radii
      for (const Circle& other : others)
        nearest = std::min(nearest, distance(column, row, other) / other.radius_px);
      Colour& c = light.relative[i];
      c = pixel(picture, row, column);
      light.clipped[i] = std::min({c[0], c[1], c[2]}) >= kClipped;
      for (std::size_t k = 0; k < 3; ++k) c[k] /= floor[k];
      const auto [least, most] = std::minmax({c[0], c[1], c[2]});
      // A body reflects less than the floor: its tint counts little. In its middle, a dome may mirror a lamp.
      const double tint =
          light.clipped[i] ? 0 : std::max(0.0, (most - least) - kLeastChroma) * std::min(1.0, most / 0.5);
      double excess = nearest > 0.45 ? std::max(0.0, most - 1 - kLeastExcess) : 0;
      // The rim is dark: what is as bright as the floor there is light.
      if (nearest > kRimFrom && nearest < kRimTo) excess = std::max(excess, 2 * (most - kBrightRim));
      light.anyones[i] = std::max(tint, excess);
      light.weight[i] = nearest < own ? 0 : light.anyones[i];
    }
  }
  return light;
}

struct Spot {
  double x = 0, y = 0;  ///< columns and rows of the grid
  double strength = 0;  ///< mean weight within the window
};

/// Sums of the weights of all pixels above and to the left.
std::vector<double> summed(const Light& light) {
  const auto columns = static_cast<std::size_t>(light.columns), rows = static_cast<std::size_t>(light.rows);
  std::vector<double> sums((columns + 1) * (rows + 1), 0);
  for (std::size_t y = 0; y < rows; ++y) {
    double line = 0;
    for (std::size_t x = 0; x < columns; ++x) {
      line += light.weight[y * columns + x];
      sums[(y + 1) * (columns + 1) + x + 1] = sums[y * (columns + 1) + x + 1] + line;
    }
  }
  return sums;
}

/// The middle of the light within a window around a point of the grid.
Spot middle_of(const Light& light, const std::vector<double>& weight, double x, double y, double window) {
  double total = 0, sum_x = 0, sum_y = 0;
  for (int row = std::max(0, cvFloor(y - window)); row <= std::min(light.rows - 1, cvCeil(y + window)); ++row) {
    for (int column = std::max(0, cvFloor(x - window)); column <= std::min(light.columns - 1, cvCeil(x + window));
         ++column) {
      const double w = weight[light.index(column, row)];
      if (w <= 0 || (column - x) * (column - x) + (row - y) * (row - y) > window * window) continue;
      total += w;
      sum_x += w * column;
      sum_y += w * row;
    }
  }
  if (total <= 0) return {};
  return {sum_x / total, sum_y / total, total / (CV_PI * window * window)};
}

/// Radius of the window that a spot fills, in columns of the grid.
double window_of(const Light& light, const Circle& disc) {
  return std::max(1.2, kSpot * disc.radius_px / light.stride);
}

/// The window with the most light, and the middle of the light in it.
Spot brightest(const Light& light, const Circle& disc) {
  const double window = window_of(light, disc);
  const int half = std::max(1, cvRound(0.85 * window));
  const std::vector<double> sums = summed(light);
  const auto at = [&](int x, int y) { return sums[static_cast<std::size_t>(y * (light.columns + 1) + x)]; };
  double most = 0;
  int best_x = -1, best_y = -1;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.columns; ++x) {
      const int left = std::max(0, x - half), right = std::min(light.columns, x + half + 1);
      const int top = std::max(0, y - half), bottom = std::min(light.rows, y + half + 1);
      const double sum = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
      if (sum > most + 1e-12) {
        most = sum;
        best_x = x;
        best_y = y;
      }
    }
  }
  if (best_x < 0) return {};
  Spot spot = middle_of(light, light.weight, best_x, best_y, window);
  // The window moves to the middle of the light.
  for (int i = 0; i < 3 && spot.strength > 0; ++i) spot = middle_of(light, light.weight, spot.x, spot.y, window);
  return spot;
}

/// Whether a spot is the rim of a neighbour's light: from it the light rises to much more, on the neighbour's side.
bool is_spilled(const Light& light, const Circle& disc, const Spot& spot) {
  const double window = window_of(light, disc);
  Spot top = spot;
  for (int i = 0; i < kClimb; ++i) top = middle_of(light, light.anyones, top.x, top.y, window);
  const int column = std::clamp(cvRound(top.x), 0, light.columns - 1),
            row = std::clamp(cvRound(top.y), 0, light.rows - 1);
  const std::size_t i = light.index(column, row);
  return light.weight[i] < light.anyones[i] && top.strength > kSpill * spot.strength;
}

/// Takes a spot out of the light, so that the next one is found.
void remove(Light& light, const Circle& disc, const Spot& spot) {
  const double reach = 2 * window_of(light, disc);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.columns; ++column) {
      if (std::hypot(column - spot.x, row - spot.y) <= reach) light.weight[light.index(column, row)] = 0;
    }
  }
}

struct Hue {
  Led led = Led::kWhite;
  bool pure = false;  ///< one channel alone
};

Hue classify(const Light& light, const Circle& disc, const Spot& spot) {
  // The colour is in the glow, at most two windows wide, and counts where the channels differ.
  const double reach = 2 * std::max(1.2, kSpot * disc.radius_px);
  Colour pure{};
  double white = 0;
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.columns; ++column) {
      const std::size_t i = light.index(column, row);
      if (light.weight[i] <= 0 || light.clipped[i]) continue;
      const double x = (column - spot.x) * light.stride, y = (row - spot.y) * light.stride;
      if (x * x + y * y > reach * reach) continue;
      const Colour& c = light.relative[i];
      const auto [least, most] = std::minmax({c[0], c[1], c[2]});
      if (most - least > kLeastChroma) {
        for (std::size_t k = 0; k < 3; ++k) pure[k] += c[k] - least;
      } else {
        white += most - 1;
      }
    }
  }
  const auto [dimmest, strongest] = std::minmax({pure[0], pure[1], pure[2]});
  if (strongest <= 0 || strongest < 0.35 * white || dimmest > kGrey * strongest) return {};
  // The saturated middle leaves white in the sum.
  for (double& channel : pure) channel -= dimmest;
  const double most = strongest - dimmest;
  const bool red = pure[0] > kMixed * most, green = pure[1] > kMixed * most, blue = pure[2] > kMixed * most;
  if (red && green) return {Led::kYellow};
  if (red && blue) return {Led::kMagenta};
  if (green && blue) return {Led::kCyan};
  const double second = pure[0] + pure[1] + pure[2] - most;  // the weakest is 0
  return {red ? Led::kRed : green ? Led::kGreen : Led::kBlue, second < kPure * most};
}

}  // namespace

std::string_view name_of(Led led) {
  constexpr std::array<std::string_view, 8> kNames{"off",    "red",     "green", "blue",
                                                   "yellow", "magenta", "cyan",  "white"};
  return kNames[static_cast<std::size_t>(led)];
}

std::uint8_t bits_of(Led led) {
  constexpr std::uint8_t kRed = 3, kGreen = 3 << 2, kBlue = 3 << 4;
  switch (led) {
    case Led::kOff: return 0;
    case Led::kRed: return kRed;
    case Led::kGreen: return kGreen;
    case Led::kBlue: return kBlue;
    case Led::kYellow: return kRed | kGreen;
    case Led::kMagenta: return kRed | kBlue;
    case Led::kCyan: return kGreen | kBlue;
    case Led::kWhite: return kRed | kGreen | kBlue;
  }
  return 0;
}

LedReading read_led(const cv::Mat& picture, const Circle& disc, const std::vector<Circle>& all_others) {
  // Those further away cover no pixel that is looked at, and are nearest to none.
  static_assert(kCovered <= kOuter && kOuter <= kFarthestFloor);
  std::vector<Circle> others;
  std::copy_if(all_others.begin(), all_others.end(), std::back_inserter(others), [&](const Circle& other) {
    return distance(other.centre.x_px, other.centre.y_px, disc) <
           kFarthestFloor * disc.radius_px + kOuter * other.radius_px;
  });
  Light light = light_around(picture, disc, others);
  if (light.weight.empty()) return {};
  Spot spot = brightest(light, disc);
  for (int tries = 0; tries < kTries && spot.strength >= kLeastLight && is_spilled(light, disc, spot); ++tries) {
    remove(light, disc, spot);
    spot = brightest(light, disc);
  }
  const bool alone = std::none_of(others.begin(), others.end(), [&](const Circle& other) {
    return distance(other.centre.x_px, other.centre.y_px, disc) < kAlone * disc.radius_px;
  });
  LedReading reading;
  reading.strength = spot.strength;
  if (spot.strength < kLeastLight) {
    reading.clear = alone && spot.strength < kClearlyDark * kLeastLight;
    return reading;
  }
  const Hue hue = classify(light, disc, spot);
  reading.led = hue.led;
  reading.clear = alone && hue.pure && spot.strength > kClearlyLit * kLeastLight;
  const double dx = light.left + spot.x * light.stride - disc.centre.x_px,
               dy = light.top + spot.y * light.stride - disc.centre.y_px;
  if (std::hypot(dx, dy) > 0.4 * disc.radius_px) reading.bearing_rad = std::atan2(-dy, dx);
  return reading;
}

}  // namespace kilotwin::track
