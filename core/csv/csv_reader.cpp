#include "core/csv/csv_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <system_error>

#include "core/base/error.hpp"

namespace kilotwin {
namespace {

constexpr std::size_t kLongestShown = 60;

std::string shown(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, kLongestShown))
    out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return text.size() > kLongestShown ? out + "..." : out;
}

bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// A tab if the first row that is not blank has one outside quotes, and no comma outside quotes; otherwise a comma.
char separator_of_header(std::string_view content) {
  bool quoted = false, tab = false, any = false;
  for (const char c : content) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == ',') return ',';
    if (c == '\n' && any) break;
    if (c == '\n') tab = false;
    tab = tab || c == '\t';
    any = any || (!is_blank(c) && c != '\r' && c != '\n');
  }
  return tab ? '\t' : ',';
}

std::string read_all(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    throw UserError(fmt::format("{}: there is no such file", file.string()));
  if (std::filesystem::is_directory(file, error))
    throw UserError(fmt::format("{}: is a directory; name a file", file.string()));
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  std::string content;
  if (const auto size = std::filesystem::file_size(file, error); !error) content.reserve(size);
  constexpr std::size_t kBlock_bytes = std::size_t{1} << 20;
  for (bool more = static_cast<bool>(in); more;) {
    const std::size_t before = content.size();
    content.resize(before + kBlock_bytes);
    more = static_cast<bool>(in.read(content.data() + before, kBlock_bytes));
    content.resize(before + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad() || !in.eof()) {
    throw UserError(fmt::format("{}: cannot be read: {}", file.string(),
                                std::generic_category().message(errno == 0 ? EIO : errno)));
  }
  return content;
}

/// Unpacks gzip data of one or several members.
std::string inflated(const std::string& name, const std::string& packed) {
  z_stream stream{};
  constexpr int kGzipOnly = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzipOnly) != Z_OK) throw RunError(name + ": zlib has no memory");
  std::string content;
  std::string block(std::size_t{1} << 20, '\0');
  std::size_t taken = 0;
  int status = Z_OK;
  while (status == Z_OK || (status == Z_STREAM_END && taken < packed.size())) {
    if (status == Z_STREAM_END) inflateReset(&stream);
    const std::size_t offered = std::min<std::size_t>(packed.size() - taken, std::size_t{1} << 30);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + taken));  // NOLINT: zlib only reads
    stream.avail_in = static_cast<uInt>(offered);
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    status = inflate(&stream, Z_NO_FLUSH);
    taken += offered - stream.avail_in;
    content.append(block, 0, block.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END) {
    throw UserError(fmt::format("{}: the gzip stream is {} at octet {}; pack the file again", name,
                                status == Z_BUF_ERROR ? "cut off" : "damaged", taken));
  }
  return content;
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& file, const CsvLayout& layout)
    : CsvReader(file.string(), read_all(file), layout) {}

CsvReader::CsvReader(std::string name, std::string content, const CsvLayout& layout)
    : file_(std::move(name)), content_(std::move(content)), layout_(layout) {
  if (content_.starts_with("\x1f\x8b")) content_ = inflated(file_, content_);
  if (content_.starts_with("\xff\xfe") || content_.starts_with("\xfe\xff"))
    throw UserError(fmt::format("{}:1:1: is UTF-16; save it as UTF-8", file_));
  begin();
}

/// Skips the byte order mark, determines the separator and reads the header.
void CsvReader::begin() {
  if (content_.starts_with("\xef\xbb\xbf")) at_ = 3;
  if (layout_.separator != '\0') {
    separator_ = layout_.separator;
  } else {
    separator_ = separator_of_header(std::string_view(content_).substr(at_));
  }
  if (!layout_.header) return;
  if (!read_row()) throw UserError(fmt::format("{}:1:1: is empty; the first line names the columns", file_));
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (!cells_[i].text.empty() && find_column(cells_[i].text))
      complain(i, fmt::format("there are two columns \"{}\"; name one of them otherwise", shown(cells_[i].text)));
    names_.emplace_back(cells_[i].text);
  }
}

std::optional<std::size_t> CsvReader::find_column(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

std::size_t CsvReader::column(std::string_view name) const {
  if (const auto found = find_column(name)) return *found;
  throw UserError(fmt::format("{}:1:1: there is no column \"{}\"; the columns are {}", file_, name,
                              shown(fmt::format("{}", fmt::join(names_, ", ")))));
}

void CsvReader::require(std::initializer_list<std::string_view> needed, std::string_view expected) const {
  std::vector<std::string_view> missing;
  for (const std::string_view name : needed) {
    if (!find_column(name)) missing.push_back(name);
  }
  if (missing.empty()) return;
  throw UserError(fmt::format("{}:1:1: the column{} {} {} missing, the header has {}; write {}", file_,
                              missing.size() == 1 ? "" : "s", fmt::join(missing, ", "),
                              missing.size() == 1 ? "is" : "are", shown(fmt::format("{}", fmt::join(names_, ", "))),
                              expected));
}

bool CsvReader::next() {
  if (!read_row()) return false;
  if (!layout_.same_width) return true;
  if (width_ == 0) width_ = layout_.header ? names_.size() : cells_.size();
  if (cells_.size() == width_) return true;
  const std::string_view reference = layout_.header ? "the header names" : "the first row has";
  if (cells_.size() < width_) {
    complain(cells_.size(), fmt::format("the row has {} cell{}; {} {}", cells_.size(),
                                        cells_.size() == 1 ? "" : "s", reference, width_));
  }
  complain(width_, fmt::format("the row has {} cells; {} {}", cells_.size(), reference, width_));
}

bool CsvReader::read_row() {
  while (at_ < content_.size()) {
    cells_.clear();
    unquoted_.clear();
    row_at_ = at_;
    row_line_ = next_line_;
    const void* const found = std::memchr(content_.data() + at_, '\n', content_.size() - at_);
    const std::size_t line_end = found == nullptr
                                     ? content_.size()
                                     : static_cast<std::size_t>(static_cast<const char*>(found) - content_.data());
    std::size_t end = line_end;
    if (end > at_ && content_[end - 1] == '\r') --end;
    if (std::memchr(content_.data() + at_, '"', end - at_) != nullptr) {
      read_quoted_row();
      return true;
    }
    at_ = std::min(line_end + 1, content_.size());
    ++next_line_;
    const std::string_view row(content_.data() + row_at_, end - row_at_);
    if (std::all_of(row.begin(), row.end(), is_blank) && (separator_ != '\t' || row.empty())) continue;
    row_end_ = end;
    read_plain_row(end);
    return true;
  }
  return false;
}

/// Reads a row without quotes, up to `end`.
void CsvReader::read_plain_row(std::size_t end) {
  const char *at = content_.data() + row_at_, *const last = content_.data() + end;
  const bool runs = separator_ == ' ';
  const char separator = separator_, other = runs ? '\t' : separator_;
  while (true) {
    while (at != last && is_blank(*at) && (runs || *at != separator)) ++at;
    if (runs && at == last) return;
    const char* stop = at;
    while (stop != last && *stop != separator && *stop != other) ++stop;
    const char* cut = stop;
    while (cut != at && is_blank(cut[-1])) --cut;
    cells_.push_back({{at, static_cast<std::size_t>(cut - at)}, static_cast<std::size_t>(at - content_.data())});
    if (stop == last) return;
    at = stop + 1;
  }
}

/// Reads the quoted cell whose opening quote is at `at`; returns the offset behind its closing quote.
std::size_t CsvReader::read_quoted_cell(std::size_t at) {
  const std::size_t opening = at++;
  std::string* text = nullptr;
  std::size_t from = at;
  while (true) {
    const std::size_t quote = content_.find('"', at);
    if (quote == std::string::npos)
      complain_at(opening, "the quoted cell has no end; close it with a quote, and write quotes within it twice");
    const bool doubled = quote + 1 < content_.size() && content_[quote + 1] == '"';
    if (!doubled && text == nullptr) {
      cells_.push_back({std::string_view(content_).substr(from, quote - from), opening});
      return quote + 1;
    }
    if (text == nullptr) text = &unquoted_.emplace_back();
    text->append(content_, from, quote - from);
    if (!doubled) {
      cells_.push_back({{}, opening});
      return quote + 1;
    }
    *text += '"';
    at = from = quote + 2;
  }
}

/// Reads a row with quotes in its first line, cell by cell, over as many lines as its quoted cells have.
void CsvReader::read_quoted_row() {
  std::vector<std::size_t> doubled;  // cells whose texts are in unquoted_, in the same order
  while (true) {
    while (at_ < content_.size() && is_blank(content_[at_]) && !(separator_ == '\t' && content_[at_] == '\t'))
      ++at_;
    if (at_ < content_.size() && content_[at_] == '"') {
      const std::size_t opening = at_, texts = unquoted_.size();
      at_ = read_quoted_cell(at_);
      if (unquoted_.size() > texts) doubled.push_back(cells_.size() - 1);
      next_line_ += static_cast<std::size_t>(std::count(content_.begin() + static_cast<std::ptrdiff_t>(opening),
                                                        content_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
      while (at_ < content_.size() && is_blank(content_[at_]) && !separates(content_[at_])) ++at_;
    } else {
      const std::size_t from = at_;
      while (at_ < content_.size() && !separates(content_[at_]) && content_[at_] != '\n') {
        if (content_[at_] == '"')
          complain_at(at_, "a quote within a cell; quote the whole cell, and write the quote twice");
        ++at_;
      }
      std::size_t to = at_;
      while (to > from && (is_blank(content_[to - 1]) || (content_[to - 1] == '\r' && to == at_))) --to;
      cells_.push_back({std::string_view(content_).substr(from, to - from), from});
    }
    if (at_ < content_.size() && separates(content_[at_])) {
      ++at_;
      continue;
    }
    row_end_ = at_;
    if (at_ + 1 < content_.size() && content_[at_] == '\r' && content_[at_ + 1] == '\n') ++at_;
    if (at_ < content_.size() && content_[at_] != '\n')
      complain_at(at_, "text after the closing quote; write a separator, or the quotes within the cell twice");
    if (at_ < content_.size()) {
      ++at_;
      ++next_line_;
    }
    break;
  }
  // Texts are linked at the end, because unquoted_ moves them while it grows.
  for (std::size_t i = 0; i < doubled.size(); ++i) cells_[doubled[i]].text = unquoted_[i];
}

std::string CsvReader::name_of(std::size_t column) const {
  return column < names_.size() ? names_[column] : fmt::format("cell {}", column + 1);
}

void CsvReader::complain_at(std::size_t offset, std::string_view what) const {
  const std::string_view before = std::string_view(content_).substr(row_at_, offset - row_at_);
  const std::size_t line = row_line_ + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  const std::size_t newline = before.rfind('\n');
  const std::size_t column = newline == std::string_view::npos ? before.size() + 1 : before.size() - newline;
  throw UserError(fmt::format("{}:{}:{}: {}", file_, line, column, what));
}

void CsvReader::complain(std::size_t column, std::string_view what) const {
  complain_at(column < cells_.size() ? cells_[column].at : row_end_, what);
}

double CsvReader::number_or_nan(std::size_t column) const {
  const std::string_view cell = cells_[column].text;
  if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NA")
    return std::numeric_limits<double>::quiet_NaN();
  return number(column);
}

double CsvReader::number(std::size_t column) const {
  const std::string_view cell = cells_[column].text;
  double value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data() + (cell.starts_with('+') ? 1 : 0), last, value);
  if (error != std::errc() || end != last || !std::isfinite(value))
    complain(column, fmt::format("{} is \"{}\"; give a number", name_of(column), shown(cell)));
  return value;
}

std::uint32_t CsvReader::whole(std::size_t column) const {
  const std::string_view cell = cells_[column].text;
  std::uint32_t value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data(), last, value);
  if (error != std::errc() || end != last)
    complain(column, fmt::format("{} is \"{}\"; give a whole number, 0..{}", name_of(column), shown(cell),
                                 std::numeric_limits<std::uint32_t>::max()));
  return value;
}

}  // namespace kilotwin
