#include "clients/cli/sweep_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <random>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

/// Parses "A..B" or "A". Returns false for other text.
template <class Integer> bool parse_range(const std::string& text, Integer& first, Integer& last) {
  const char* const end = text.data() + text.size();
  std::from_chars_result read = std::from_chars(text.data(), end, first);
  if (read.ec != std::errc()) return false;
  last = first;
  if (end - read.ptr > 2 && read.ptr[0] == '.' && read.ptr[1] == '.')
    read = std::from_chars(read.ptr + 2, end, last);
  return read.ec == std::errc() && read.ptr == end && first <= last;
}

[[noreturn]] void refuse(const std::string& text, const std::string& what) {
  throw UserError(fmt::format("--set: \"{}\": {}; give V1,V2, A..B, A..B:STEP or log:A..B:N", text, what));
}

/// "[log:]A..B[:LAST]" of real numbers.
struct RealRange {
  double first = 0, last = 0;
  bool log = false, whole = false;
  std::optional<double> third;  ///< step, or count of a logarithmic range
};

std::optional<double> parse_real(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

bool is_whole(std::string_view text) {
  return !text.empty() && text.find_first_not_of("+-0123456789") == std::string_view::npos;
}

std::optional<RealRange> parse_real_range(std::string_view text) {
  RealRange range;
  constexpr std::string_view kLog = "log:";
  if (text.starts_with(kLog)) {
    range.log = true;
    text.remove_prefix(kLog.size());
  }
  const std::size_t dots = text.find("..");
  if (dots == std::string_view::npos) return std::nullopt;
  const std::string_view low = text.substr(0, dots);
  std::string_view high = text.substr(dots + 2);
  if (const std::size_t colon = high.find(':'); colon != std::string_view::npos) {
    range.third = parse_real(high.substr(colon + 1));
    if (!range.third) return std::nullopt;
    high = high.substr(0, colon);
  }
  const auto first = parse_real(low), last = parse_real(high);
  if (!first || !last || !(*first <= *last) || (range.log && !(*first > 0))) return std::nullopt;
  range.first = *first;
  range.last = *last;
  range.whole = is_whole(low) && is_whole(high);
  return range;
}

std::string number_text(double value, bool whole) {
  return whole ? fmt::format("{:.0f}", std::round(value)) : fmt::format("{:.10g}", value);
}

void add_log_values(const std::string& text, const RealRange& range, std::vector<std::string>& values) {
  const double count = range.third.value_or(0);
  if (!(count >= 2 && count <= static_cast<double>(kMostSweepRuns)) || count != std::floor(count))
    refuse(text, "a logarithmic range needs its number of values, at least 2: log:0.01..10:7");
  for (double i = 0; i < count; ++i)
    values.push_back(number_text(range.first * std::pow(range.last / range.first, i / (count - 1)), false));
}

void add_steps(const std::string& text, const RealRange& range, std::vector<std::string>& values) {
  if (!(*range.third > 0)) refuse(text, "a step is above 0");
  constexpr double kSlack = 1e-9;  // of a step: 0..1:0.1 includes 1
  const double steps = std::floor((range.last - range.first) / *range.third + kSlack);
  if (!(steps < static_cast<double>(kMostSweepRuns)))
    throw UserError(fmt::format("--set: {} are more than {} values", text, kMostSweepRuns));
  const bool whole = range.whole && *range.third == std::floor(*range.third);
  for (double i = 0; i <= steps; ++i) values.push_back(number_text(range.first + i * *range.third, whole));
}

void add_values(const std::string& text, std::vector<std::string>& values) {
  std::int64_t first = 0, last = 0;
  if (text.find("..") != std::string::npos && parse_range(text, first, last)) {
    if (static_cast<std::uint64_t>(last) - static_cast<std::uint64_t>(first) >= kMostSweepRuns)
      throw UserError(fmt::format("--set: {} are more than {} values", text, kMostSweepRuns));
    for (std::int64_t value = first;; ++value) {
      values.push_back(std::to_string(value));
      if (value == last) return;
    }
  }
  if (const auto range = parse_real_range(text)) {
    if (range->log) return add_log_values(text, *range, values);
    if (range->third) return add_steps(text, *range, values);
    refuse(text, "a range of numbers with a fraction needs a step, such as 0.1..1:0.1");
  }
  values.push_back(text);
}

std::pair<std::string, std::vector<std::string>> parse_set(const std::string& set) {
  const std::size_t equals = set.find('=');
  if (equals == std::string::npos)
    throw UserError(fmt::format("--set: \"{}\" has no value; give FIELD=V1,V2 or FIELD=A..B", set));
  std::pair<std::string, std::vector<std::string>> parsed{set.substr(0, equals + 1), {}};
  for (std::size_t from = equals + 1; from <= set.size();) {
    const std::size_t to = std::min(set.find(',', from), set.size());
    parsed.second.push_back(set.substr(from, to - from));
    from = to + 1;
  }
  return parsed;
}

/// Uniform in [0, 1), alike with every standard library.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// `count` values, one from each cell of equal width, in random order.
std::vector<std::string> stratified(const std::vector<std::string>& parts, std::size_t count,
                                    std::mt19937_64& random) {
  const auto range = parts.size() == 1 ? parse_real_range(parts[0]) : std::nullopt;
  std::vector<std::string> values;
  for (std::size_t cell = 0; cell < count; ++cell) {
    const double share = (static_cast<double>(cell) + uniform(random)) / static_cast<double>(count);
    if (!range) {
      values.push_back(parts[static_cast<std::size_t>(share * static_cast<double>(parts.size()))]);
    } else if (range->log) {
      values.push_back(number_text(range->first * std::pow(range->last / range->first, share), false));
    } else if (range->whole) {
      values.push_back(number_text(std::floor(range->first + share * (range->last - range->first + 1)), true));
    } else {
      values.push_back(number_text(range->first + share * (range->last - range->first), false));
    }
  }
  for (std::size_t i = count; i > 1; --i)
    std::swap(values[i - 1], values[static_cast<std::size_t>(uniform(random) * static_cast<double>(i))]);
  return values;
}

}  // namespace

std::vector<std::uint64_t> parse_seeds(const std::string& text) {
  std::uint64_t first = 0, last = 0;
  if (!parse_range(text, first, last) || last - first >= kMostSweepRuns) {
    throw UserError(fmt::format("--seeds: \"{}\" is no range; give FIRST..LAST such as 1..20, at most {} seeds",
                                text, kMostSweepRuns));
  }
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t i = 0; i <= last - first; ++i) seeds.push_back(first + i);
  return seeds;
}

std::vector<SweepPoint> sweep_points(const std::vector<std::string>& sets) {
  std::vector<SweepPoint> points{{}};
  for (const std::string& set : sets) {
    const auto [field, parts] = parse_set(set);
    std::vector<std::string> values;
    for (const std::string& part : parts) add_values(part, values);
    if (values.size() > kMostSweepRuns / points.size())
      throw UserError(fmt::format("--set: more than {} combinations", kMostSweepRuns));
    std::vector<SweepPoint> more;
    for (const SweepPoint& point : points) {
      for (const std::string& value : values) {
        more.push_back(point);
        more.back().push_back(field + value);
      }
    }
    points = std::move(more);
  }
  return points;
}

std::vector<SweepPoint> latin_points(const std::vector<std::string>& sets, std::size_t count, std::uint64_t seed) {
  if (sets.empty()) throw UserError("--latin: no ranges; give --set FIELD=A..B for each field");
  if (count < 1 || count > kMostSweepRuns)
    throw UserError(fmt::format("--latin: {} points; it takes 1 to {}", count, kMostSweepRuns));
  std::mt19937_64 random(seed);
  std::vector<SweepPoint> points(count);
  for (const std::string& set : sets) {
    const auto [field, parts] = parse_set(set);
    if (parts.size() == 1 && parts[0].find("..") != std::string::npos) {
      const auto range = parse_real_range(parts[0]);
      if (!range || range->third) refuse(parts[0], "with --latin a range is A..B or log:A..B");
    }
    const std::vector<std::string> values = stratified(parts, count, random);
    for (std::size_t i = 0; i < count; ++i) points[i].push_back(field + values[i]);
  }
  return points;
}

std::string label(const SweepPoint& point) {
  std::string text;
  for (const std::string& set : point) text += (text.empty() ? "" : ", ") + set;
  return text;
}

std::string field_of(const std::string& set) { return set.substr(0, set.find('=')); }

std::optional<double> number_of(const std::string& set) {
  const std::size_t equals = set.find('=');
  double value = 0;
  const char* const end = set.data() + set.size();
  const auto [position, error] = std::from_chars(set.data() + equals + 1, end, value);
  if (error != std::errc() || position != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace kilotwin::cli
