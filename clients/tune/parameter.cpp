#include "clients/tune/parameter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "core/base/error.hpp"

namespace kilotwin::tune {
namespace {

constexpr std::string_view kLog = "log:";

double number(std::string_view text, const std::string& all, const std::string& option) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw UserError(
        fmt::format("{}: \"{}\" in \"{}\" is no number; expected NAME=A..B or NAME=log:A..B", option, text, all));
  return value;
}

bool is_whole(std::string_view text) { return text.find_first_not_of("+-0123456789") == std::string_view::npos; }

}  // namespace

Parameter parse_parameter(const std::string& text, const std::string& option, bool macro) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UserError(fmt::format("{}: expected NAME=A..B or NAME=log:A..B, not \"{}\"", option, text));
  Parameter parameter;
  parameter.name = text.substr(0, equals);
  parameter.macro = macro;
  std::string_view range = std::string_view(text).substr(equals + 1);
  if (range.starts_with(kLog)) {
    parameter.logarithmic = true;
    range.remove_prefix(kLog.size());
  }
  const std::size_t dots = range.find("..");
  if (dots == std::string_view::npos) throw UserError(fmt::format("{}: \"{}\" has no range A..B", option, text));
  const std::string_view low = range.substr(0, dots), high = range.substr(dots + 2);
  parameter.low = number(low, text, option);
  parameter.high = number(high, text, option);
  if (parameter.low >= parameter.high)
    throw UserError(fmt::format("{}: the range of \"{}\" is empty", option, text));
  if (parameter.logarithmic && parameter.low <= 0)
    throw UserError(fmt::format("{}: a logarithmic range begins above 0, not as in \"{}\"", option, text));
  parameter.whole = is_whole(low) && is_whole(high);
  return parameter;
}

double value_at(const Parameter& p, double place) {
  place = std::clamp(place, 0.0, 1.0);
  if (p.whole) {
    // Each whole number has the same share of the interval (of ratios, where logarithmic).
    if (p.logarithmic)
      return std::clamp(std::round(std::exp(std::lerp(std::log(p.low), std::log(p.high), place))), p.low, p.high);
    return std::min(p.high, std::floor(p.low + place * (p.high - p.low + 1)));
  }
  if (p.logarithmic) return std::exp(std::lerp(std::log(p.low), std::log(p.high), place));
  return std::lerp(p.low, p.high, place);
}

std::string setting_at(const Parameter& p, double place) {
  return p.whole ? fmt::format("{}={:.0f}", p.name, value_at(p, place))
                 : fmt::format("{}={:.6g}", p.name, value_at(p, place));
}

}  // namespace kilotwin::tune
