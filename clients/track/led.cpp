#include "clients/track/led.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "clients/track/led_light.hpp"
#include "clients/track/led_sources.hpp"

namespace kilotwin::track {
namespace {

constexpr double kOuter = 1.35;  ///< the spot's light reaches that far from the centre, radii
constexpr double kSpot = 0.32;   ///< radius of the window that a spot fills, radii
/// Sum of what is above these, relative to the area of a window, above which there is a spot.
constexpr double kLeastLight = 0.10;
/// A second channel with this share of the strongest one belongs to the colour.
constexpr double kMixed = 0.5;
/// A source whose colour has less than this share of its white light is white: its white light hides the colours of others.
constexpr double kHuelessSource = 0.6;
/// Of a source without a hue, those pixels count that are at least so many times closer to it than to any other source.
constexpr double kClaimed = 2;
/// Robots farther away than this, radii, matter to no pixel.
constexpr double kFarthestLight = 4.4;
/// No class is clear if the centre of another robot is nearer than this, radii: its light may be taken for this robot's.
constexpr double kAlone = 3.0;
/// A class is clear below this share of the second channel; and above, or below, these multiples of the least light.
constexpr double kPure = 0.3, kClearlyLit = 2, kClearlyDark = 0.5;
/// Where even the weakest one has this share, the light is white.
constexpr double kGrey = 0.7;
/// Light that rises across the border to another robot, to more than this multiple, is the other's. So many windows are looked at.
constexpr double kSpill = 1.5;
constexpr int kClimb = 8, kTries = 3;

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
  const auto at = [&](int x, int y) {
    const int place = y * (light.columns + 1) + x;
    return sums[static_cast<std::size_t>(place)];
  };
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

/// The class of summed light: of pixels with a colour, less their dimmest channel, and of pixels without one.
Hue hue_of(Colour pure, double white) {
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
  return hue_of(pure, white);
}

/// The reading of a robot that shares no light with others. `alone`: no other robot's light can be taken for its own.
LedReading reading_alone(Light light, const Circle& disc, bool alone) {
  if (light.weight.empty()) return {};
  Spot spot = brightest(light, disc);
  for (int tries = 0; tries < kTries && spot.strength >= kLeastLight && is_spilled(light, disc, spot); ++tries) {
    remove(light, disc, spot);
    spot = brightest(light, disc);
  }
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

/// Leaves the light of those pixels alone that are nearest to the own source.
void claim(Light& light, const LedSource& source) {
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.columns; ++column) {
      const Point at = light.pixel(column, row);
      const double own_px = distance_px(at, source.at);
      const bool others = std::any_of(source.others.begin(), source.others.end(), [&](const Point& other) {
        return distance_px(at, other) < kClaimed * own_px;
      });
      const std::size_t i = light.index(column, row);
      light.weight[i] = others ? 0 : light.anyones[i];
    }
  }
}

/// The reading of a robot whose light others share.
LedReading reading_shared(Light light, const Circle& disc, const std::vector<Circle>& near) {
  const std::optional<LedSource> source = own_source(light, disc, near);
  if (!source) return {};
  const double strongest = std::max({source->colour[0], source->colour[1], source->colour[2]});
  LedReading reading;
  reading.strength = std::max(strongest, source->white);
  reading.bearing_rad = std::atan2(disc.centre.y_px - source->at.y_px, source->at.x_px - disc.centre.x_px);
  if (strongest >= kHuelessSource * source->white) {
    reading.led = hue_of(source->colour, 0).led;
  } else {
    // A saturated LED shows its colour in the glow alone.
    claim(light, *source);
    const Spot spot{(source->at.x_px - light.left) / light.stride, (source->at.y_px - light.top) / light.stride, 0};
    reading.led = classify(light, disc, spot).led;
  }
  return reading;
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
  std::vector<Circle> others, near;
  bool alone = true;
  for (const Circle& other : all_others) {
    const double apart = distance_px(other.centre.x_px, other.centre.y_px, disc) / disc.radius_px;
    if (apart < kFarthestLight) others.push_back(other);
    if (apart < kSharedLight) near.push_back(other);
    alone = alone && apart >= kAlone;
  }
  if (near.empty()) return reading_alone(light_around(picture, disc, others, kOuter), disc, alone);
  return reading_shared(light_around(picture, disc, others, kSourcesReach), disc, near);
}

}  // namespace kilotwin::track
