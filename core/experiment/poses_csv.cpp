#include "core/experiment/poses_csv.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <string>

#include "core/base/pose.hpp"
#include "core/experiment/limits.hpp"
#include "core/experiment/text_file.hpp"
#include "core/math/elementary.h"

namespace kilotwin {

namespace {

constexpr std::string_view kRadians = "x_mm,y_mm,heading_rad", kDegrees = "x_mm,y_mm,heading_deg";
constexpr std::array<std::string_view, 3> kColumns = {"x_mm", "y_mm", "heading"};

std::string_view trimmed(std::string_view cell) {
  while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
  while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
  return cell;
}

class PosesReader {
 public:
  explicit PosesReader(std::string name) : name_(std::move(name)) {}
  CsvPoses read(std::string_view text);

 private:
  void read_header(std::string_view row);
  void read_row(std::string_view row);
  [[nodiscard]] double number(std::string_view row, std::string_view cell, std::string_view column) const;
  /// `at` is a part of `row`.
  [[nodiscard]] UserError error(std::string_view row, std::string_view at, std::string_view text) const {
    return UserError{fmt::format("{}:{}:{}: {}", name_, line_, at.data() - row.data() + 1, text)};
  }

  std::string name_;
  std::uint32_t line_ = 0;
  bool has_header_ = false, degrees_ = false;
  CsvPoses poses_;
};

void PosesReader::read_header(std::string_view row) {
  std::string header;
  for (const char c : row) {
    if (c != ' ' && c != '\t') header += c;
  }
  degrees_ = header == kDegrees;
  if (!degrees_ && header != kRadians) {
    throw error(row, row,
                fmt::format("the header is {}; it takes {} or {}", one_line(row, 60), kRadians, kDegrees));
  }
  has_header_ = true;
}

double PosesReader::number(std::string_view row, std::string_view cell, std::string_view column) const {
  const std::string_view digits = trimmed(cell);
  double value = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = failure == std::errc{} && end == digits.data() + digits.size();
  if (whole && value - value == 0) return value;
  throw error(
      row, digits.empty() ? cell : digits,
      fmt::format("{} is {}; it takes a finite number", column, digits.empty() ? "empty" : one_line(digits, 60)));
}

void PosesReader::read_row(std::string_view row) {
  std::array<double, kColumns.size()> value{};
  std::size_t columns = 0;
  for (std::size_t begin = 0; begin <= row.size(); ++columns) {
    const std::size_t end = std::min(row.find(',', begin), row.size());
    if (columns == value.size()) {
      throw error(
          row, row.substr(begin),
          fmt::format("the row goes on after {} columns; it takes {}", columns, degrees_ ? kDegrees : kRadians));
    }
    value[columns] = number(row, row.substr(begin, end - begin), kColumns[columns]);
    begin = end + 1;
  }
  if (columns < value.size()) {
    throw error(row, row.substr(row.size()),
                fmt::format("the row ends after {} column{}; it takes {}", columns, columns == 1 ? "" : "s",
                            degrees_ ? kDegrees : kRadians));
  }
  if (poses_.line.size() == kMostRobots) {
    throw error(row, row,
                fmt::format("the file has more rows than {}; that many robots are the most", kMostRobots));
  }
  const double heading_rad = degrees_ ? kt_fmod(value[2], 360) * (kPi / 180) : kt_fmod(value[2], 2 * kPi);
  poses_.x_mm.push_back(value[0]);
  poses_.y_mm.push_back(value[1]);
  poses_.heading_rad.push_back(wrapped(heading_rad));
  poses_.line.push_back(line_);
}

CsvPoses PosesReader::read(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view row = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (row.ends_with('\r')) row.remove_suffix(1);
    ++line_;
    if (trimmed(row).empty()) continue;
    if (has_header_)
      read_row(row);
    else
      read_header(row);
  }
  if (poses_.line.empty()) {
    throw UserError{fmt::format("{}:{}:1: there are no poses; the file takes the header {} and a row per robot",
                                name_, line_ + 1, kRadians)};
  }
  return std::move(poses_);
}

}  // namespace

CsvPoses read_poses_csv(const std::filesystem::path& file, std::string_view named_at) {
  return PosesReader{one_line(file.string())}.read(read_text(file, named_at));
}

}  // namespace kilotwin
