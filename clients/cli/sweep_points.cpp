#include "clients/cli/sweep_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

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
  values.push_back(text);
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
    const std::size_t equals = set.find('=');
    if (equals == std::string::npos)
      throw UserError(fmt::format("--set: \"{}\" has no value; give FIELD=V1,V2 or FIELD=A..B", set));
    std::vector<std::string> values;
    for (std::size_t from = equals + 1; from <= set.size();) {
      const std::size_t to = std::min(set.find(',', from), set.size());
      add_values(set.substr(from, to - from), values);
      from = to + 1;
    }
    if (values.size() > kMostSweepRuns / points.size())
      throw UserError(fmt::format("--set: more than {} combinations", kMostSweepRuns));
    std::vector<SweepPoint> more;
    for (const SweepPoint& point : points) {
      for (const std::string& value : values) {
        more.push_back(point);
        more.back().push_back(set.substr(0, equals + 1) + value);
      }
    }
    points = std::move(more);
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
