#include "clients/identify/data/csv_reader.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <cmath>
#include <limits>

#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

std::string content_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(fmt::format("{}: there is no such file", file.string()));
  const gzFile in = gzopen(file.c_str(), "rb");  // reads plain files as well
  if (in == nullptr) throw UserError(fmt::format("{}: cannot be opened", file.string()));
  gzbuffer(in, 1 << 17);
  std::string content;
  constexpr unsigned kBlock = 1 << 20;
  int got = 0;
  do {
    const std::size_t before = content.size();
    content.resize(before + kBlock);
    got = gzread(in, content.data() + before, kBlock);
    content.resize(before + static_cast<std::size_t>(got > 0 ? got : 0));
  } while (got > 0);
  int state = Z_OK;
  const std::string reason = gzerror(in, &state);
  const bool well = got == 0 && (state == Z_OK || state == Z_STREAM_END);
  gzclose(in);
  if (!well) throw UserError(fmt::format("{}: cannot be read: {}", file.string(), reason));
  return content;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

}  // namespace

CsvReader::CsvReader(std::filesystem::path file) : file_(std::move(file)), content_(content_of(file_)) {
  std::string_view header;
  while (header.empty() && at_ < content_.size()) header = trimmed(line());
  if (header.empty())
    throw UserError(fmt::format("{}: is empty; its first line names the columns", file_.string()));
  split(header);
  for (const std::string_view cell : cells_) names_.emplace_back(cell);
}

std::string_view CsvReader::line() {
  const std::size_t end = std::min(content_.find('\n', at_), content_.size());
  const std::string_view found(content_.data() + at_, end - at_);
  line_start_ = found.data();
  at_ = end + 1;
  ++line_;
  return found;
}

void CsvReader::split(std::string_view row) {
  cells_.clear();
  while (true) {
    const std::size_t comma = row.find(',');
    cells_.push_back(trimmed(row.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    row.remove_prefix(comma + 1);
  }
}

std::optional<std::size_t> CsvReader::find_column(std::string_view name) const {
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (names_[i] == name) return i;
  return std::nullopt;
}

std::size_t CsvReader::column(std::string_view name) const {
  if (const auto found = find_column(name)) return *found;
  throw UserError(fmt::format("{}:1:1: there is no column \"{}\"; the columns are {}", file_.string(), name,
                              fmt::join(names_, ", ")));
}

bool CsvReader::next() {
  while (at_ < content_.size()) {
    const std::string_view row = line();
    if (trimmed(row).empty()) continue;
    split(row);
    if (cells_.size() != names_.size()) {
      throw UserError(fmt::format("{}:{}:1: has {} cells; the first line names {}", file_.string(), line_,
                                  cells_.size(), names_.size()));
    }
    return true;
  }
  return false;
}

void CsvReader::complain(std::size_t column, const std::string& what) const {
  throw UserError(
      fmt::format("{}:{}:{}: {}", file_.string(), line_, cells_[column].data() - line_start_ + 1, what));
}

double CsvReader::number_or_nan(std::size_t column) const {
  const std::string_view cell = cells_[column];
  if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NA")
    return std::numeric_limits<double>::quiet_NaN();
  return number(column);
}

double CsvReader::number(std::size_t column) const {
  const std::string_view cell = cells_[column];
  double value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data() + (cell.starts_with('+') ? 1 : 0), last, value);
  if (error != std::errc() || end != last || !std::isfinite(value))
    complain(column, fmt::format("{} is \"{}\"; give a number", names_[column], cell));
  return value;
}

std::uint32_t CsvReader::whole(std::size_t column) const {
  const std::string_view cell = cells_[column];
  std::uint32_t value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data(), last, value);
  if (error != std::errc() || end != last)
    complain(column, fmt::format("{} is \"{}\"; give a whole number, 0..{}", names_[column], cell,
                                 std::numeric_limits<std::uint32_t>::max()));
  return value;
}

}  // namespace kilotwin::identify
