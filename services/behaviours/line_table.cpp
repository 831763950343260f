#include "services/behaviours/line_table.hpp"

#include <elfutils/libdw.h>

#include <memory>
#include <utility>

namespace kilotwin::behaviours {
namespace {

/// The row of a table that covers the offset. A row covers the addresses up to that of the next row.
std::optional<LineTables::Place> find_row(Dwarf_Lines* lines, std::size_t count, std::uint64_t offset) {
  for (std::size_t i = 0; i + 1 < count; ++i) {
    Dwarf_Line* const row = dwarf_onesrcline(lines, i);
    Dwarf_Addr from = 0, to = 0;
    if (dwarf_lineaddr(row, &from) != 0 || dwarf_lineaddr(dwarf_onesrcline(lines, i + 1), &to) != 0) continue;
    if (offset < from || offset >= to) continue;
    bool ends = false;
    int line = 0;
    const char* const path = dwarf_linesrc(row, nullptr, nullptr);
    if (dwarf_lineendsequence(row, &ends) != 0 || ends || dwarf_lineno(row, &line) != 0 || path == nullptr)
      continue;
    const std::string name = path;
    return LineTables::Place{name.substr(name.rfind('/') + 1), static_cast<std::uint32_t>(line)};
  }
  return std::nullopt;
}

/// Whether the table has rows of functions that the linker has removed. It leaves them at address 0, so they may cover the
/// addresses of other functions.
bool has_removed_functions(Dwarf_Lines* lines, std::size_t count) {
  Dwarf_Addr first = 0;
  return count > 0 && dwarf_lineaddr(dwarf_onesrcline(lines, 0), &first) == 0 && first == 0;
}

}  // namespace

std::optional<LineTables::Place> LineTables::find(std::uint64_t offset) const {
  if (elf_version(EV_CURRENT) == EV_NONE) return std::nullopt;
  std::string octets = elf;  // libelf takes memory that it may write to
  const std::unique_ptr<Elf, int (*)(Elf*)> file(elf_memory(octets.data(), octets.size()), elf_end);
  if (!file) return std::nullopt;
  const std::unique_ptr<Dwarf, int (*)(Dwarf*)> dwarf(dwarf_begin_elf(file.get(), DWARF_C_READ, nullptr),
                                                      dwarf_end);
  if (!dwarf) return std::nullopt;
  Dwarf_Off at = 0, next = 0;
  Dwarf_CU* unit = nullptr;
  Dwarf_Lines* lines = nullptr;
  std::size_t count = 0;
  std::optional<Place> doubtful;
  for (; dwarf_next_lines(dwarf.get(), at, &next, &unit, nullptr, nullptr, &lines, &count) == 0; at = next) {
    auto found = find_row(lines, count, offset);
    if (!found) continue;
    if (!has_removed_functions(lines, count)) return found;
    if (!doubtful) doubtful = std::move(found);
  }
  return doubtful;
}

}  // namespace kilotwin::behaviours
