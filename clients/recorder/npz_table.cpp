// The archive is a ZIP file without compression (APPNOTE 6.3), with its 64-bit records throughout, so that no array is too long.
// Arrays are NPY 1.0 files: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#include "clients/recorder/npz_table.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

#include "clients/recorder/utf8.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50, kEnd64 = 0x06064b50,
                        kLocator64 = 0x07064b50;
constexpr std::uint16_t kVersion64 = 45;         // ZIP64
constexpr std::uint16_t kDate1980 = 1 << 5 | 1;  // equal tables give equal files
constexpr std::uint32_t kIn64 = 0xffffffffu;     // the number is in the 64-bit record
constexpr std::size_t kMostComment = 0xffff;
constexpr std::int64_t kMissingText = -1;
/// A missing whole number. No recorded value is that small but by intent.
constexpr std::int64_t kMissingInteger = std::numeric_limits<std::int64_t>::min();

/// Little-endian numbers, one after the other.
class Octets {
 public:
  template <class Number> Octets& operator<<(Number value) {
    for (std::size_t i = 0; i < sizeof value; ++i)
      text_ += static_cast<char>(static_cast<std::uint64_t>(value) >> 8 * i & 0xff);
    return *this;
  }
  Octets& operator<<(const std::string& text) {
    text_ += text;
    return *this;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct Member {
  std::string name, comment;
  std::uint64_t offset = 0, size = 0;
  std::uint32_t crc = 0;
};

std::string local_header(const Member& member) {
  Octets octets;
  octets << kLocal << kVersion64 << std::uint16_t{0} << std::uint16_t{0} << std::uint16_t{0} << kDate1980
         << member.crc << kIn64 << kIn64 << static_cast<std::uint16_t>(member.name.size()) << std::uint16_t{20}
         << member.name << std::uint16_t{1} << std::uint16_t{16} << member.size << member.size;
  return octets.text();
}

std::string directory(const std::vector<Member>& members, std::uint64_t offset, const std::string& comment) {
  Octets octets;
  for (const Member& member : members) {
    octets << kCentral << kVersion64 << kVersion64 << std::uint16_t{0} << std::uint16_t{0} << std::uint16_t{0}
           << kDate1980 << member.crc << kIn64 << kIn64 << static_cast<std::uint16_t>(member.name.size())
           << std::uint16_t{28} << static_cast<std::uint16_t>(member.comment.size()) << std::uint16_t{0}
           << std::uint16_t{0} << std::uint32_t{0} << kIn64 << member.name << std::uint16_t{1} << std::uint16_t{24}
           << member.size << member.size << member.offset << member.comment;
  }
  const std::uint64_t size = octets.text().size(), count = members.size();
  octets << kEnd64 << std::uint64_t{44} << kVersion64 << kVersion64 << std::uint32_t{0} << std::uint32_t{0} << count
         << count << size << offset;
  octets << kLocator64 << std::uint32_t{0} << offset + size << std::uint32_t{1};
  octets << kEnd << std::uint16_t{0} << std::uint16_t{0} << std::uint16_t{0xffff} << std::uint16_t{0xffff} << kIn64
         << kIn64 << static_cast<std::uint16_t>(comment.size()) << comment;
  return octets.text();
}

std::string array_header(const std::string& type, std::uint64_t rows) {
  constexpr std::size_t kAlignment = 64, kPrefix = 10;
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({},), }}", type, rows);
  text.append(kAlignment - (kPrefix + text.size() + 1) % kAlignment, ' ');
  text += '\n';
  Octets octets;
  octets << std::string("\x93NUMPY\x01") + '\0' << static_cast<std::uint16_t>(text.size()) << text;
  return octets.text();
}

/// table_json() within the length of a comment: where that is too long, without the columns, which their members describe, and
/// without as many of the longest texts as it takes.
std::string fitting_json(const std::vector<Column>& columns, TableMetadata metadata) {
  std::string json = table_json(columns, metadata);
  if (json.size() > kMostComment) json = table_json({}, metadata);
  while (json.size() > kMostComment) {
    metadata.erase(std::max_element(metadata.begin(), metadata.end(), [](const auto& a, const auto& b) {
      return a.second.size() < b.second.size();
    }));
    json = table_json({}, metadata);
  }
  return json;
}

/// Cells of a block. A column's last block may have fewer.
constexpr std::size_t kBlock = 8192;

/// A block: the octets per cell, the least number, and each cell's number above it in so many octets, little-endian.
constexpr std::size_t kBlockHead = 1 + sizeof(std::int64_t);

template <class Octet>
void append_narrow(std::string& to, const std::vector<std::uint64_t>& cells, std::uint64_t least) {
  const std::size_t begin = to.size();
  to.resize(begin + cells.size() * sizeof(Octet));
  char* at = to.data() + begin;
  for (const std::uint64_t cell : cells) {
    const auto narrow = static_cast<Octet>(cell - least);
    std::memcpy(at, &narrow, sizeof narrow);
    at += sizeof narrow;
  }
}

template <class Octet> void read_narrow(const char* at, std::vector<std::uint64_t>& cells, std::uint64_t least) {
  for (std::uint64_t& cell : cells) {
    Octet narrow = 0;
    std::memcpy(&narrow, at, sizeof narrow);
    cell = least + narrow;
    at += sizeof narrow;
  }
}

void append_block(std::string& to, const std::vector<std::uint64_t>& cells, bool whole_numbers) {
  std::uint64_t least = 0, range = std::numeric_limits<std::uint64_t>::max();
  if (whole_numbers) {
    const auto less = [](std::uint64_t a, std::uint64_t b) {
      return std::bit_cast<std::int64_t>(a) < std::bit_cast<std::int64_t>(b);
    };
    const auto [low, high] = std::minmax_element(cells.begin(), cells.end(), less);
    least = *low;
    range = *high - least;
  }
  const std::uint8_t width = range == 0 ? 0 : range <= 0xff ? 1 : range <= 0xffff ? 2 : range <= 0xffffffff ? 4 : 8;
  to += static_cast<char>(width);
  to.append(reinterpret_cast<const char*>(&least), sizeof least);
  if (width == 1) append_narrow<std::uint8_t>(to, cells, least);
  if (width == 2) append_narrow<std::uint16_t>(to, cells, least);
  if (width == 4) append_narrow<std::uint32_t>(to, cells, least);
  if (width == 8) append_narrow<std::uint64_t>(to, cells, least);
}

/// Sets `cells`, whose number is known, from a block's octets after its head.
void read_block(std::uint8_t width, std::uint64_t least, const char* octets, std::vector<std::uint64_t>& cells) {
  if (width == 0) std::fill(cells.begin(), cells.end(), least);
  if (width == 1) read_narrow<std::uint8_t>(octets, cells, least);
  if (width == 2) read_narrow<std::uint16_t>(octets, cells, least);
  if (width == 4) read_narrow<std::uint32_t>(octets, cells, least);
  if (width == 8) read_narrow<std::uint64_t>(octets, cells, least);
}

}  // namespace

NpzTable::NpzTable(std::filesystem::path file, std::vector<Column> columns, const TableMetadata& metadata,
                   std::size_t most_waiting)
    : Table(columns.size()),
      file_(std::move(file)),
      described_(std::move(columns)),
      comment_(fitting_json(described_, metadata)),
      most_waiting_(most_waiting) {
  output_.reset(std::fopen(file_.c_str(), "wb"));
  if (!output_) fail();
  waiting_.resize(columns_);
}

void NpzTable::fail() const {
  throw RunError(fmt::format("{}: cannot be written: {}", file_.string(), os::system_reason()));
}

void NpzTable::put(std::uint64_t bits) {
  std::vector<std::uint64_t>& cells = waiting_[cell_].cells;
  cells.push_back(bits);
  if (cells.size() == kBlock) pack(cell_);
  ++cell_;
}

void NpzTable::pack(std::size_t column) {
  Waiting& waiting = waiting_[column];
  if (waiting.cells.empty()) return;
  const CellType type = described_[column].type;
  const std::size_t before = waiting.blocks.size();
  append_block(waiting.blocks, waiting.cells, type == CellType::kInteger || type == CellType::kText);
  packed_ += waiting.blocks.size() - before;
  waiting.cells.clear();
  if (packed_ > most_waiting_) spill();
}

void NpzTable::spill() {
  for (Waiting& waiting : waiting_) {
    if (!waiting.spilled) waiting.spilled.reset(std::tmpfile());
    if (!waiting.spilled) throw RunError(fmt::format("a temporary file cannot be made: {}", os::system_reason()));
    const std::string& blocks = waiting.blocks;
    if (std::fwrite(blocks.data(), 1, blocks.size(), waiting.spilled.get()) != blocks.size() ||
        std::fflush(waiting.spilled.get()) != 0)
      throw RunError(fmt::format("a temporary file cannot be written: {}", os::system_reason()));
    waiting.blocks.clear();
  }
  packed_ = 0;
}

void NpzTable::integer(std::int64_t value) { put(std::bit_cast<std::uint64_t>(value)); }

void NpzTable::number(double value) { put(std::bit_cast<std::uint64_t>(value)); }

void NpzTable::text(std::string_view value) {
  Waiting& waiting = waiting_[cell_];
  auto found = waiting.texts.find(value);
  if (found == waiting.texts.end()) {
    found = waiting.texts.emplace(value, static_cast<std::int64_t>(waiting.by_number.size())).first;
    waiting.by_number.emplace_back(value);
    waiting.longest = std::max(waiting.longest, code_points(value).size());
  }
  integer(found->second);
}

void NpzTable::missing() {
  waiting_[cell_].any_missing = true;
  switch (described_[cell_].type) {
    case CellType::kInteger: return integer(kMissingInteger);
    case CellType::kText: return integer(kMissingText);
    default: return number(std::numeric_limits<double>::quiet_NaN());
  }
}

void NpzTable::end_row() {
  KILOTWIN_DEMAND(cell_ == columns_);
  cell_ = 0;
  ++rows_;
}

void NpzTable::append(const void* octets, std::size_t size) {
  if (std::fwrite(octets, 1, size, output_.get()) != size) fail();
  written_ += size;
  crc_ = static_cast<std::uint32_t>(::crc32_z(crc_, static_cast<const Bytef*>(octets), size));
}

void NpzTable::copy(Waiting& waiting, const Column& column) {
  const bool is_text = column.type == CellType::kText;
  const bool as_double = column.type == CellType::kInteger && waiting.any_missing;
  const std::string type = is_text                                           ? fmt::format("<U{}", waiting.longest)
                           : column.type == CellType::kInteger && !as_double ? "<i8"
                                                                             : "<f8";
  const std::string header = array_header(type, rows_);
  append(header.data(), header.size());
  std::vector<std::u32string> texts{std::u32string(waiting.longest, U'\0')};  // the first: none
  for (const std::string& text : waiting.by_number) {
    texts.push_back(code_points(text));
    texts.back().resize(waiting.longest, U'\0');
  }
  if (waiting.spilled) std::rewind(waiting.spilled.get());
  std::string_view in_memory = waiting.blocks;
  std::string octets;
  const auto next = [&](std::size_t count) {
    octets.resize(count);
    if (waiting.spilled && std::fread(octets.data(), 1, count, waiting.spilled.get()) == count) return;
    if (waiting.spilled && std::ferror(waiting.spilled.get()) != 0)
      throw RunError(fmt::format("a temporary file cannot be read: {}", os::system_reason()));
    waiting.spilled.reset();
    KILOTWIN_DEMAND(in_memory.size() >= count);
    in_memory.copy(octets.data(), count);
    in_memory.remove_prefix(count);
  };
  std::vector<std::uint64_t> cells;
  std::u32string text;
  for (std::uint64_t left = rows_; left > 0; left -= cells.size()) {
    cells.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, kBlock)));
    next(kBlockHead);
    const auto width = static_cast<std::uint8_t>(octets[0]);
    std::uint64_t least = 0;
    std::memcpy(&least, octets.data() + 1, sizeof least);
    next(width * cells.size());
    read_block(width, least, octets.data(), cells);
    if (is_text) {
      text.clear();
      for (const std::uint64_t cell : cells) text += texts[static_cast<std::size_t>(cell + 1)];
      append(text.data(), text.size() * sizeof(char32_t));
      continue;
    }
    for (std::size_t i = 0; i < cells.size() && as_double; ++i) {
      const auto value = std::bit_cast<std::int64_t>(cells[i]);
      cells[i] = std::bit_cast<std::uint64_t>(value == kMissingInteger ? std::numeric_limits<double>::quiet_NaN()
                                                                       : static_cast<double>(value));
    }
    append(cells.data(), cells.size() * sizeof(std::uint64_t));
  }
}

void NpzTable::close() {
  std::vector<Member> members;
  for (std::size_t i = 0; i < columns_; ++i) {
    Member& member = members.emplace_back();
    member.name = described_[i].name + ".npy";
    member.comment = column_json(described_[i]);
    member.offset = written_;
    const std::string placeholder = local_header(member);
    append(placeholder.data(), placeholder.size());
    const std::uint64_t begin = written_;
    crc_ = 0;
    pack(i);
    copy(waiting_[i], described_[i]);
    waiting_[i] = Waiting();
    member.size = written_ - begin;
    member.crc = crc_;
    // The checksum is known now.
    const std::string header = local_header(member);
    if (::fseeko(output_.get(), static_cast<off_t>(member.offset), SEEK_SET) != 0 ||
        std::fwrite(header.data(), 1, header.size(), output_.get()) != header.size() ||
        ::fseeko(output_.get(), 0, SEEK_END) != 0)
      fail();
  }
  const std::string end = directory(members, written_, comment_);
  append(end.data(), end.size());
  if (std::fclose(output_.release()) != 0) fail();
}

}  // namespace kilotwin::recorder
