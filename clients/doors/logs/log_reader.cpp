#include "clients/doors/logs/log_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "clients/doors/tracked_frame.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"

namespace kilotwin::doors {
namespace {

constexpr int kLarsHeaderLines = 9;
/// 100000 robots of six columns.
constexpr std::size_t kLongestLine = 16U << 20U;
constexpr double kDefaultArkUnit_s = 1, kDefaultLarsUnit_s = 0.001;
/// Codes of colours in both logs: off, red, green, blue.
constexpr std::array<std::uint8_t, 4> kLed{0, 3, 3 << 2, 3 << 4};

std::unique_ptr<std::istream> opened(const std::filesystem::path& file) {
  std::error_code ignored;
  auto stream = std::make_unique<std::ifstream>(file, std::ios::binary);
  if (*stream && !std::filesystem::is_directory(file, ignored)) return stream;
  throw UserError(fmt::format("{}: cannot be read; name a log", one_line(file.string())));
}

}  // namespace

LogReader::LogReader(const std::filesystem::path& file, const proto::LogDoor& log)
    : LogReader(opened(file), one_line(file.string()), log) {}

LogReader::LogReader(std::unique_ptr<std::istream> stream, std::string name, const proto::LogDoor& log)
    : stream_(std::move(stream)),
      name_(std::move(name)),
      lars_(log.format() == proto::LogDoor::LARS),
      time_unit_s_(log.has_time_unit_s() ? log.time_unit_s() : (lars_ ? kDefaultLarsUnit_s : kDefaultArkUnit_s)),
      columns_(log.columns()) {
  if (lars_) skip_header();
}

void LogReader::complain(std::size_t column, const std::string& what) const {
  throw UserError(fmt::format("{}:{}:{}: {}", name_, line_number_, column, what));
}

void LogReader::skip_header() {
  for (int i = 0; i < kLarsHeaderLines; ++i) {
    if (next_line()) continue;
    throw UserError(
        fmt::format("{}:{}:1: the file ends within the header; a log of LARS begins with {} lines before "
                    "the first row",
                    name_, line_number_ + 1, kLarsHeaderLines));
  }
}

bool LogReader::next_line() {
  line_.clear();
  ++line_number_;
  for (int c = stream_->get(); c != std::istream::traits_type::eof(); c = stream_->get()) {
    if (c == '\n') return true;
    if (line_.size() == kLongestLine) complain(1, "the line is longer than 16 MiB; it takes a row of a log");
    line_ += static_cast<char>(c);
  }
  if (!line_.empty()) return true;
  --line_number_;
  return false;
}

void LogReader::split() {
  std::size_t end = line_.size();
  while (end > 0 && (line_[end - 1] == '\r' || line_[end - 1] == '\t' || line_[end - 1] == ' ')) --end;
  fields_.clear();
  const std::string_view text = std::string_view(line_).substr(0, end);
  if (text.empty()) return;
  for (std::size_t begin = 0;;) {
    const std::size_t tab = std::min(text.find('\t', begin), text.size());
    fields_.push_back({text.substr(begin, tab - begin), begin + 1});
    if (tab == text.size()) return;
    begin = tab + 1;
  }
}

void LogReader::find_columns() {
  const std::size_t count = fields_.size() - 1;
  std::string fitting;
  int found = 0;
  const auto candidates = lars_ ? std::array<std::size_t, 3>{3, 4, 6} : std::array<std::size_t, 3>{5, 6, 6};
  for (std::size_t i = 0; i < (lars_ ? candidates.size() : 2); ++i) {
    if (count % candidates[i] != 0) continue;
    columns_ = candidates[i];
    fitting += fmt::format("{}{}", found++ ? " and " : "", candidates[i]);
  }
  if (count > 0 && found == 1) return;
  const char* const known = lars_ ? "3, 4 or 6" : "5 or 6";
  if (found == 0) {
    complain(1, fmt::format("the row has {} columns after the time; it takes {} per robot, separated by tabs",
                            count, known));
  }
  if (count == 0) complain(1, "the first row holds a time alone; state columns in the door's log { ... }");
  complain(1, fmt::format("the row fits {} columns per robot; state columns in the door's log {{ ... }}", fitting));
}

double LogReader::number(const Field& field, const char* what) const {
  double value = 0;
  const char* const last = field.text.data() + field.text.size();
  const auto [end, error] = std::from_chars(field.text.data(), last, value);
  if (error == std::errc() && end == last) return value;
  complain(field.column, fmt::format("{} is \"{}\"; it takes a number", what, one_line(field.text, 40)));
}

std::uint64_t LogReader::whole(const Field& field, const char* what) const {
  std::uint64_t value = 0;
  const char* const last = field.text.data() + field.text.size();
  const auto [end, error] = std::from_chars(field.text.data(), last, value);
  if (error == std::errc() && end == last) return value;
  complain(field.column,
           fmt::format("{} is \"{}\"; it takes a whole number, at least 0", what, one_line(field.text, 40)));
}

LogRobot LogReader::robot(const Field* fields) const {
  LogRobot out;
  out.number = whole(fields[0], "a robot's number");
  const std::size_t x = lars_ ? 1 : 2;
  out.x = number(fields[x], "x");
  out.y = number(fields[x + 1], "y");
  if (!lars_ || columns_ >= 4) {
    const std::uint64_t code = whole(fields[lars_ ? 3 : 1], "a colour");
    out.led = code < kLed.size() ? kLed[code] : kLedUnknown;
  }
  if (!lars_) {
    const double degrees = number(fields[4], "an orientation");
    if (std::isfinite(degrees)) out.heading_rad = std::remainder(degrees, 360.0) * kPi / 180;
  } else if (columns_ == 6) {
    out.vx = number(fields[4], "a velocity");
    out.vy = number(fields[5], "a velocity");
  }
  return out;
}

std::optional<LogRow> LogReader::next() {
  do {
    if (!next_line()) return std::nullopt;
    split();
  } while (fields_.empty());
  if (columns_ == 0) find_columns();
  if ((fields_.size() - 1) % columns_ != 0) {
    complain(1, fmt::format("the row has {} columns after the time; it takes {} per robot, separated by tabs",
                            fields_.size() - 1, columns_));
  }
  LogRow row;
  const double time = number(fields_[0], "the time");
  if (!std::isfinite(time * time_unit_s_)) complain(1, "the time is not finite; it takes a number");
  if (last_time_ && time < *last_time_)
    complain(1, fmt::format("the time is {}, before the row above; times must not go back", time));
  last_time_ = time;
  row.time_s = time * time_unit_s_;
  std::vector<std::pair<std::uint64_t, std::size_t>> numbers;
  for (std::size_t i = 1; i < fields_.size(); i += columns_) {
    row.robots.push_back(robot(&fields_[i]));
    numbers.emplace_back(row.robots.back().number, fields_[i].column);
  }
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (numbers[i].first == numbers[i - 1].first)
      complain(numbers[i].second,
               fmt::format("robot {} is twice in the row; it takes each robot once", numbers[i].first));
  }
  return row;
}

}  // namespace kilotwin::doors
