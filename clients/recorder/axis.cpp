#include "clients/recorder/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Ticks meant to lie on an end of the axis may miss it by rounding.
constexpr double kSlack = 1e-9;

}  // namespace

double round_step(double range, int pieces) {
  KILOTWIN_DEMAND(range > 0 && pieces > 0);
  const double least = range / pieces;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1 - kSlack)) return factor * power;
  }
  return 10 * power;
}

AxisTicks linear_ticks(double low, double high, int pieces) {
  AxisTicks ticks;
  const double step = round_step(high - low, pieces);
  const double largest = std::max(std::abs(low), std::abs(high));
  if (largest >= 1e5 || largest < 1e-2)
    ticks.exponent = 3 * static_cast<int>(std::floor(std::log10(largest * (1 + kSlack)) / 3));
  const double unit = std::pow(10, ticks.exponent);
  const int decimals = std::clamp(static_cast<int>(-std::floor(std::log10(step / unit) + kSlack)), 0, 15);
  const double first = std::ceil(low / step - kSlack), last = std::floor(high / step + kSlack);
  for (double multiple = first; multiple <= last && ticks.at.size() < 100; ++multiple) {
    ticks.at.push_back(multiple * step + 0.0);
    ticks.label.push_back(fmt::format("{:.{}f}", multiple * step / unit + 0.0, decimals));
  }
  return ticks;
}

AxisTicks logarithmic_ticks(double low, double high) {
  KILOTWIN_DEMAND(low > 0 && high > low);
  AxisTicks ticks;
  const int first = static_cast<int>(std::floor(std::log10(low))),
            last = static_cast<int>(std::ceil(std::log10(high)));
  const bool dense = high / low < 300;
  const int every = std::max(1, (last - first) / 8);
  for (int exponent = first; exponent <= last; exponent += every) {
    for (const int factor : {1, 2, 5}) {
      if (factor > 1 && !dense) break;
      const double value = factor * std::pow(10, exponent);
      if (value < low * (1 - kSlack) || value > high * (1 + kSlack)) continue;
      ticks.at.push_back(value);
      const bool plain = exponent >= -3 && exponent <= 4;
      ticks.label.push_back(plain        ? fmt::format("{:.{}f}", value, std::max(0, -exponent))
                            : factor > 1 ? fmt::format("{}\u00b7{}", factor, power_of_ten(exponent))
                                         : power_of_ten(exponent));
    }
  }
  return ticks;
}

std::string power_of_ten(int exponent) {
  constexpr std::array<std::string_view, 10> kRaised = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                                        "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  std::string text = "10";
  for (const char c : std::to_string(exponent))
    text += c == '-' ? "\u207b" : kRaised[static_cast<std::size_t>(c - '0')];
  return text;
}

}  // namespace kilotwin::recorder
