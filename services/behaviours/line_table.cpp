#include "services/behaviours/line_table.hpp"

#include <string_view>
#include <vector>

namespace kilotwin::behaviours {
namespace {

/// Reads little-endian values one after the other. Beyond the end it returns 0 and `good` is false.
class Octets {
 public:
  explicit Octets(std::string_view octets) : rest_(octets) {}

  std::uint64_t fixed(unsigned size) {
    if (size > 8 || size > rest_.size()) return fail();
    std::uint64_t value = 0;
    for (unsigned i = 0; i < size; ++i) value |= std::uint64_t{static_cast<std::uint8_t>(rest_[i])} << 8 * i;
    rest_.remove_prefix(size);
    return value;
  }
  std::uint64_t variable(bool is_signed = false) {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
      const std::uint64_t octet = fixed(1);
      if (shift < 64) value |= (octet & 0x7f) << shift;
      if ((octet & 0x80) != 0 && good) continue;
      if (is_signed && (octet & 0x40) != 0 && shift + 7 < 64) value |= ~std::uint64_t{0} << (shift + 7);
      return value;
    }
  }
  std::string_view text() {
    const std::size_t end = rest_.find('\0');
    if (end == std::string_view::npos) return fail(), std::string_view{};
    const std::string_view result = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return result;
  }
  Octets part(std::uint64_t size) {
    if (size > rest_.size()) fail();
    const Octets result(rest_.substr(0, size));
    rest_.remove_prefix(result.rest_.size());
    return result;
  }
  [[nodiscard]] bool empty() const { return rest_.empty(); }

  bool good = true;

 private:
  std::uint64_t fail() {
    good = false;
    rest_ = {};
    return 0;
  }
  std::string_view rest_;
};

/// One line table: a header, and the line-number program that generates the rows.
class Table {
 public:
  Table(Octets& octets, const LineTables& sections) : sections_(sections), body_(octets.part(octets.fixed(4))) {}

  std::optional<LineTables::Place> find(std::uint64_t offset) {
    if (!read_header()) return std::nullopt;
    return run(offset);
  }

 private:
  struct Format {
    std::uint64_t content, form;
  };

  bool read_header() {
    version_ = body_.fixed(2);
    if (version_ < 2 || version_ > 5) return false;
    if (version_ == 5) (void)body_.fixed(2);
    Octets header = body_.part(body_.fixed(4));
    shortest_ = header.fixed(1);
    if (version_ >= 4) (void)header.fixed(1);
    (void)header.fixed(1);
    line_base_ = static_cast<std::int8_t>(header.fixed(1));
    line_range_ = header.fixed(1);
    const std::uint64_t opcodes = header.fixed(1);
    for (std::uint64_t i = 1; i < opcodes && header.good; ++i) operands_.push_back(header.fixed(1));
    if (version_ == 5) {
      (void)read_names(header);
      files_ = read_names(header);
    } else {
      while (header.good && !header.text().empty()) {}
      files_.emplace_back();
      for (std::string_view name = header.text(); header.good && !name.empty(); name = header.text()) {
        files_.emplace_back(name);
        for (int i = 0; i < 3; ++i) (void)header.variable();
      }
    }
    return header.good && line_range_ > 0 && !operands_.empty();
  }

  /// Reads a list of directories or files (DWARF 5), whose entry format the header describes, and returns the names.
  std::vector<std::string> read_names(Octets& header) {
    constexpr std::uint64_t kPath = 1;
    std::vector<Format> formats(header.fixed(1));
    for (Format& format : formats) format = {header.variable(), header.variable()};
    std::vector<std::string> names;
    for (std::uint64_t count = header.variable(); count > 0 && header.good; --count) {
      std::string name;
      for (const Format& format : formats) {
        const std::string value = read_form(header, format.form);
        if (format.content == kPath) name = value;
      }
      names.push_back(name);
    }
    return names;
  }

  std::string read_form(Octets& header, std::uint64_t form) {
    switch (form) {
      case 0x08: return std::string(header.text());
      case 0x1f: return string_at(sections_.debug_line_str, header.fixed(4));
      case 0x0e: return string_at(sections_.debug_str, header.fixed(4));
      case 0x0b: return (void)header.fixed(1), "";
      case 0x05: return (void)header.fixed(2), "";
      case 0x06: return (void)header.fixed(4), "";
      case 0x0f: return (void)header.variable(), "";
      case 0x1e: return (void)header.part(16), "";
      default: header.good = false; return "";
    }
  }

  static std::string string_at(const std::string& section, std::uint64_t offset) {
    return offset < section.size() ? section.substr(offset, section.find('\0', offset) - offset) : "";
  }

  std::optional<LineTables::Place> run(std::uint64_t wanted) {
    std::uint64_t address = 0, file = 1, line = 1;
    std::uint64_t before = 0, before_file = 0, before_line = 0;
    bool has_before = false;
    std::optional<LineTables::Place> found;
    const auto row = [&](bool ends) {
      if (has_before && before <= wanted && wanted < address && before_file < files_.size()) {
        const std::string& name = files_[before_file];
        found = {name.substr(name.rfind('/') + 1), static_cast<std::uint32_t>(before_line)};
      }
      before = address;
      before_file = file;
      before_line = line;
      has_before = !ends;
    };
    while (!body_.empty() && body_.good && !found) {
      const std::uint64_t opcode = body_.fixed(1);
      if (opcode > operands_.size()) {
        const std::uint64_t special = opcode - operands_.size() - 1;
        address += special / line_range_ * shortest_;
        line += static_cast<std::uint64_t>(line_base_ + static_cast<std::int64_t>(special % line_range_));
        row(false);
        continue;
      }
      switch (opcode) {
        case 0: {  // extended opcode
          Octets rest = body_.part(body_.variable());
          const std::uint64_t kind = rest.fixed(1);
          if (kind == 2) address = rest.fixed(8);
          if (kind != 1) break;
          row(true);
          address = 0;
          file = line = 1;
          break;
        }
        case 1: row(false); break;
        case 2: address += body_.variable() * shortest_; break;
        case 3: line += body_.variable(true); break;
        case 4: file = body_.variable(); break;
        case 8: address += (255 - operands_.size() - 1) / line_range_ * shortest_; break;
        case 9: address += body_.fixed(2); break;
        default:
          for (std::uint64_t i = 0; i < operands_[opcode - 1]; ++i) (void)body_.variable();
      }
    }
    return found;
  }

  const LineTables& sections_;
  Octets body_;
  std::uint64_t version_ = 0, shortest_ = 1, line_range_ = 0;
  std::int64_t line_base_ = 0;
  std::vector<std::uint64_t> operands_;
  std::vector<std::string> files_;
};

}  // namespace

std::optional<LineTables::Place> LineTables::find(std::uint64_t offset) const {
  Octets octets(debug_line);
  while (!octets.empty() && octets.good) {
    if (const auto found = Table(octets, *this).find(offset)) return found;
  }
  return std::nullopt;
}

}  // namespace kilotwin::behaviours
