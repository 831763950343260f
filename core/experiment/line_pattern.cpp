#include "core/experiment/line_pattern.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin {
namespace {

constexpr std::size_t kMostOctets = 9, kLongestPattern = 256;
constexpr int kDecimal = 10, kHex = 16;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Takes a whole number off the front of a text.
std::optional<std::uint64_t> take_number(std::string_view& rest) {
  const bool is_hexadecimal = rest.starts_with("0x") || rest.starts_with("0X");
  const char* const begin = rest.data() + (is_hexadecimal ? 2 : 0);
  const char* const last = rest.data() + rest.size();
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(begin, last, value, is_hexadecimal ? kHex : kDecimal);
  if (error != std::errc()) return std::nullopt;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value;
}

std::optional<double> take_length(std::string_view& rest) {
  double value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc() || !std::isfinite(value) || value < 0) return std::nullopt;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value;
}

}  // namespace

std::string LinePattern::parse(std::string_view pattern, std::vector<Part>& parts) {
  struct Field {
    std::string_view name;
    Kind kind;
  };
  static constexpr Field kFields[] = {{"{data}", Kind::kData},
                                      {"{type}", Kind::kType},
                                      {"{sender}", Kind::kSender},
                                      {"{distance}", Kind::kDistance},
                                      {"{skip}", Kind::kSkip}};
  if (pattern.size() > kLongestPattern)
    return fmt::format("line has {} characters; it takes at most {}", pattern.size(), kLongestPattern);
  pattern = without_blanks(pattern);
  bool has_data = false;
  while (!pattern.empty()) {
    if (is_blank(pattern.front())) {
      parts.push_back({Kind::kBlanks, {}});
      while (is_blank(pattern.front())) pattern.remove_prefix(1);
      continue;
    }
    if (pattern.front() != '{') {
      const std::size_t length = static_cast<std::size_t>(
          std::find_if(pattern.begin(), pattern.end(), [](char c) { return c == '{' || is_blank(c); }) -
          pattern.begin());
      parts.push_back({Kind::kText, std::string(pattern.substr(0, length))});
      pattern.remove_prefix(length);
      continue;
    }
    const auto* const field = std::find_if(std::begin(kFields), std::end(kFields),
                                           [&](const Field& each) { return pattern.starts_with(each.name); });
    if (field == std::end(kFields)) {
      return fmt::format("\"{}\" is no field; there are {{data}}, {{type}}, {{sender}}, {{distance}} and {{skip}}",
                         one_line(pattern.substr(0, pattern.find('}') + 1), 40));
    }
    const auto is_same = [&](const Part& part) { return part.kind == field->kind; };
    if (field->kind != Kind::kSkip && std::any_of(parts.begin(), parts.end(), is_same))
      return fmt::format("{} stands twice; write it once", field->name);
    has_data = has_data || field->kind == Kind::kData;
    parts.push_back({field->kind, {}});
    pattern.remove_prefix(field->name.size());
  }
  if (!has_data) return "{data} is missing; it stands for the octets of the message";
  auto behind =
      std::find_if(parts.begin(), parts.end(), [](const Part& part) { return part.kind == Kind::kData; }) + 1;
  if (behind != parts.end() && behind->kind == Kind::kBlanks) ++behind;
  if (behind == parts.end() || behind->kind == Kind::kText) return {};
  return "{data} takes all numbers that follow; put a word behind it, as in \"{data} at {distance}\"";
}

LinePattern::LinePattern(std::string_view pattern) {
  const std::string wrong = parse(pattern, parts_);
  if (!wrong.empty()) throw UserError(wrong);
}

std::string defect_of_line_pattern(std::string_view pattern) {
  std::vector<LinePattern::Part> parts;
  return LinePattern::parse(pattern, parts);
}

/// Octets with blanks, commas or both between them, as many as there are.
bool LinePattern::take_data(std::string_view& rest, HeardLine& line) {
  for (;;) {
    const auto octet = take_number(rest);
    constexpr std::uint64_t kMostOctet = 255;
    if (!octet || *octet > kMostOctet || line.data.size() == kMostOctets) return false;
    line.data.push_back(static_cast<std::uint8_t>(*octet));
    std::string_view behind = rest;
    while (!behind.empty() && is_blank(behind.front())) behind.remove_prefix(1);
    if (behind.starts_with(',')) behind.remove_prefix(1);
    while (!behind.empty() && is_blank(behind.front())) behind.remove_prefix(1);
    const bool goes_on =
        behind.size() < rest.size() && !behind.empty() && behind.front() >= '0' && behind.front() <= '9';
    if (!goes_on) return true;
    rest = behind;
  }
}

bool LinePattern::take(const Part& part, std::string_view& rest, HeardLine& line) {
  switch (part.kind) {
    case Kind::kText:
      if (!rest.starts_with(part.text)) return false;
      rest.remove_prefix(part.text.size());
      return true;
    case Kind::kBlanks:
      if (rest.empty() || !is_blank(rest.front())) return false;
      while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
      return true;
    case Kind::kData: return take_data(rest, line);
    case Kind::kType: {
      const auto type = take_number(rest);
      if (!type || *type > 255) return false;
      line.type = static_cast<std::uint8_t>(*type);
      return true;
    }
    case Kind::kSender: return (line.sender = take_number(rest)).has_value();
    case Kind::kDistance: return (line.distance_mm = take_length(rest)).has_value();
    case Kind::kSkip:
      if (rest.empty() || is_blank(rest.front())) return false;
      while (!rest.empty() && !is_blank(rest.front())) rest.remove_prefix(1);
      return true;
  }
  return false;
}

std::optional<HeardLine> LinePattern::match(std::string_view text) const {
  std::string_view rest = without_blanks(text);
  HeardLine line;
  for (const Part& part : parts_) {
    if (!take(part, rest, line)) return std::nullopt;
  }
  if (!rest.empty()) return std::nullopt;
  return line;
}

}  // namespace kilotwin
