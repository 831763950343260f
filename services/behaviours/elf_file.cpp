#include "services/behaviours/elf_file.hpp"

#include <elf.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::uint64_t kMostOctets = 16u << 20;  // upper limit of an image's size

class Parser {
 public:
  Parser(std::string_view octets, const std::string& name) : octets_(octets), name_(name) {}

  ElfFile parse() {
    read_header();
    read_segments();
    read_dynamic();
    relocate();
    find_data();
    read_table();
    read_functions();
    find_sections();
    file_.lines.elf = octets_;
    return std::move(file_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw UserError(name_ + ": not a program for simulated robots: " + what + "; make one with `kilotwin build`");
  }
  void require(bool condition, const char* what) const {
    if (!condition) fail(what);
  }

  /// Reads a structure at an offset of the file or the image; nothing if it reaches beyond the end.
  template <class T, class Octets> static std::optional<T> at(const Octets& from, std::uint64_t offset) {
    if (offset > from.size() || from.size() - offset < sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, from.data() + offset, sizeof(T));
    return value;
  }
  template <class T, class Octets> T required(const Octets& from, std::uint64_t offset, const char* what) const {
    const auto value = at<T>(from, offset);
    if (!value) fail(what);
    return *value;
  }

  void read_header() {
    header_ = required<Elf64_Ehdr>(octets_, 0, "too short");
    require(std::memcmp(header_.e_ident, ELFMAG, SELFMAG) == 0 && header_.e_ident[EI_CLASS] == ELFCLASS64 &&
                header_.e_ident[EI_DATA] == ELFDATA2LSB && header_.e_type == ET_DYN &&
                header_.e_machine == EM_X86_64,
            "no shared object for x86-64");
    require(header_.e_phentsize == sizeof(Elf64_Phdr) && header_.e_phnum <= 64, "strange program headers");
  }

  void read_segments() {
    std::uint64_t end = 0;
    for (std::uint64_t i = 0; i < header_.e_phnum; ++i) {
      const auto h = required<Elf64_Phdr>(octets_, header_.e_phoff + i * sizeof(Elf64_Phdr), "cut off");
      if (h.p_type == PT_INTERP || (h.p_type == PT_TLS && h.p_memsz > 0))
        fail("it needs an operating system below it");
      if (h.p_type == PT_DYNAMIC) dynamic_ = {h.p_vaddr, h.p_vaddr + std::min(h.p_memsz, kMostOctets)};
      if (h.p_type == PT_GNU_RELRO) {
        require(h.p_vaddr <= kMostOctets && h.p_memsz <= kMostOctets, "too large");
        file_.relro = {page_down(h.p_vaddr), page_down(h.p_vaddr + h.p_memsz)};
      }
      if (h.p_type != PT_LOAD || h.p_memsz == 0) continue;
      require(h.p_vaddr <= kMostOctets && h.p_memsz <= kMostOctets && h.p_filesz <= h.p_memsz, "too large");
      require(h.p_offset <= octets_.size() && h.p_filesz <= octets_.size() - h.p_offset, "cut off");
      const ElfFile::Segment segment{
          {h.p_vaddr, h.p_vaddr + h.p_memsz}, (h.p_flags & PF_W) != 0, (h.p_flags & PF_X) != 0};
      require(page_down(h.p_vaddr) >= end, "segments overlap");
      require(!(segment.writable && segment.executable), "a segment is both writable and executable");
      end = page_up(segment.range.last + (segment.writable ? kSlackOctets : 0));
      require(end <= kMostOctets, "too large");
      file_.memory.resize(end);
      if (h.p_filesz > 0) std::memcpy(file_.memory.data() + h.p_vaddr, octets_.data() + h.p_offset, h.p_filesz);
      file_.segments.push_back(segment);
    }
    require(!file_.segments.empty(), "no segments");
    require(file_.relro.last <= end, "strange program headers");
    if (file_.relro.last <= file_.relro.first) file_.relro = {};
  }

  void read_dynamic() {
    for (std::uint64_t offset = dynamic_.first; offset < dynamic_.last; offset += sizeof(Elf64_Dyn)) {
      const auto entry = required<Elf64_Dyn>(file_.memory, offset, "cut off");
      const std::uint64_t value = entry.d_un.d_val;
      switch (entry.d_tag) {
        case DT_NULL: return;
        case DT_RELA: rela_ = value; break;
        case DT_RELASZ: rela_size_ = value; break;
        case DT_JMPREL: plt_ = value; break;
        case DT_PLTRELSZ: plt_size_ = value; break;
        case DT_SYMTAB: symbols_ = value; break;
        case DT_RELAENT: require(value == sizeof(Elf64_Rela), "strange relocations"); break;
        case DT_PLTREL: require(value == DT_RELA, "strange relocations"); break;
        case DT_SYMENT: require(value == sizeof(Elf64_Sym), "strange symbols"); break;
        case DT_NEEDED: fail("it needs other libraries");
        case DT_TEXTREL: fail("its code would have to be changed on loading");
        case DT_INIT:
        case DT_FINI: fail("it has constructors or destructors");
        case DT_INIT_ARRAYSZ:
        case DT_FINI_ARRAYSZ: require(value == 0, "it has constructors or destructors"); break;
        case DT_RELSZ:
        case 35 /* DT_RELRSZ */: require(value == 0, "strange relocations"); break;
        default: break;
      }
    }
  }

  void store(std::uint64_t offset, std::uint64_t value) {
    std::memcpy(file_.memory.data() + offset, &value, sizeof value);
  }

  void relocate_table(std::uint64_t table, std::uint64_t size) {
    require(size <= kMostOctets && size % sizeof(Elf64_Rela) == 0, "strange relocations");
    for (std::uint64_t at = 0; at < size; at += sizeof(Elf64_Rela)) {
      const auto r = required<Elf64_Rela>(file_.memory, table + at, "cut off");
      const bool inside = std::any_of(file_.segments.begin(), file_.segments.end(), [&](const ElfFile::Segment& s) {
        return s.writable && s.range.contains(r.r_offset, sizeof(std::uint64_t));
      });
      require(inside, "a relocation outside its data");
      std::uint64_t value = static_cast<std::uint64_t>(r.r_addend);
      bool moves = true;
      switch (ELF64_R_TYPE(r.r_info)) {
        case R_X86_64_RELATIVE: break;
        case R_X86_64_GLOB_DAT:
        case R_X86_64_JUMP_SLOT:
        case R_X86_64_64: {
          const std::uint64_t index = ELF64_R_SYM(r.r_info);
          const auto symbol =
              required<Elf64_Sym>(file_.memory, symbols_ + index * sizeof(Elf64_Sym), "strange symbols");
          if (ELF64_R_TYPE(r.r_info) != R_X86_64_64) value = 0;
          if (symbol.st_shndx == SHN_UNDEF) {
            require(ELF64_ST_BIND(symbol.st_info) == STB_WEAK, "it needs a function that is not there");
            moves = false;
          } else {
            value += symbol.st_value;
            moves = symbol.st_shndx != SHN_ABS;
          }
          break;
        }
        default: fail("a relocation of unknown kind");
      }
      store(r.r_offset, value);
      if (moves) file_.relocations.push_back(static_cast<std::uint32_t>(r.r_offset));
      places_.push_back(r.r_offset);
    }
  }

  void relocate() {
    relocate_table(rela_, rela_size_);
    relocate_table(plt_, plt_size_);
    std::sort(places_.begin(), places_.end());
    for (std::size_t i = 1; i < places_.size(); ++i) {
      require(places_[i] - places_[i - 1] >= sizeof(std::uint64_t), "relocations overlap");
    }
    std::sort(file_.relocations.begin(), file_.relocations.end());
  }

  void find_data() {
    std::uint64_t first = kMostOctets, last = 0;
    for (const ElfFile::Segment& segment : file_.segments) {
      if (!segment.writable) {
        require(segment.range.last <= file_.relro.first || segment.range.first >= file_.relro.last,
                "strange program headers");
        continue;
      }
      if (segment.range.last <= file_.relro.last) continue;
      first = std::min(first, std::max(segment.range.first, file_.relro.last));
      last = std::max(last, segment.range.last);
    }
    require(first < last, "it has no data");
    for (const ElfFile::Segment& segment : file_.segments) {
      require(segment.writable || segment.range.last <= first || segment.range.first >= last,
              "strange program headers");
    }
    file_.data = {first, last};
  }

  void read_table() {
    const auto table = required<KtImage>(file_.memory, header_.e_entry, "it was made for something else");
    require(table.magic == KT_IMAGE_MAGIC, "it was made for something else");
    require(table.version == KT_IMAGE_VERSION, "it was made by another version of kilotwin");
    auto executable = [&](std::uint64_t offset) {
      return std::any_of(file_.segments.begin(), file_.segments.end(),
                         [&](const ElfFile::Segment& s) { return s.executable && s.range.contains(offset, 1); });
    };
    for (const std::uint64_t offset :
         {table.boot, table.enter, table.call, table.leave, table.interrupts, table.transmit}) {
      require(executable(offset), "its table of functions is damaged");
    }
    require(file_.data.contains(table.variables, 1), "its table of functions is damaged");
    file_.pad = {file_.data.first, table.variables};
    file_.data.first = table.variables;
    require(file_.data.contains(table.robot, sizeof(KtRobot)) && file_.data.contains(table.ticks, 4) &&
                file_.data.contains(table.tx_period, 2) && file_.relro.contains(table.exchange, 8) &&
                file_.relro.contains(table.surroundings, 8),
            "its table of functions is damaged");
    // Every address of the table must have a relocation, and no other word of it may have one.
    constexpr std::uint64_t kAddresses = (sizeof(KtImage) - offsetof(KtImage, exchange)) / 8;
    const std::uint64_t first = header_.e_entry + offsetof(KtImage, exchange);
    const auto lower = std::lower_bound(file_.relocations.begin(), file_.relocations.end(), first - 23);
    std::uint64_t count = 0;
    for (auto it = lower; it != file_.relocations.end() && *it < first + 8 * kAddresses; ++it) {
      require(*it >= first && (*it - first) % 8 == 0, "its table of functions is damaged");
      ++count;
    }
    require(count == kAddresses, "its table of functions is damaged");
    file_.table = table;
  }

  /// Finds the sections that a reset preserves, and the heap. A file without section names has neither.
  void find_sections() {
    const auto section_at = [&](std::uint64_t i) {
      return at<Elf64_Shdr>(octets_, header_.e_shoff + i * sizeof(Elf64_Shdr));
    };
    const auto strings = section_at(header_.e_shstrndx);
    if (!strings || strings->sh_offset > octets_.size()) return;
    const std::string_view names = octets_.substr(strings->sh_offset, strings->sh_size);
    for (std::uint64_t i = 0; i < header_.e_shnum; ++i) {
      const auto section = section_at(i);
      if (!section || section->sh_name >= names.size() || !file_.data.contains(section->sh_addr, section->sh_size))
        continue;
      const std::string_view name = names.substr(section->sh_name);
      const std::string_view whole = name.substr(0, name.find('\0'));
      if (whole.starts_with(".noinit") || whole == "kilotwin_eeprom")
        file_.kept.push_back({section->sh_addr, section->sh_addr + section->sh_size});
      // A heap section that is not directly behind the data is ordinary data.
      constexpr std::uint64_t kBefore = 64;  // see constructors.ld
      if (whole == KT_HEAP_SECTION && section->sh_size >= kBefore &&
          section->sh_addr + section->sh_size == file_.data.last) {
        file_.heap = {section->sh_addr + kBefore, section->sh_addr + section->sh_size};
        file_.data.last = file_.heap.first;
      }
    }
  }

  /// Reads the functions' names, which only messages use. Damaged entries are skipped.
  void read_functions() {
    for (std::uint64_t i = 0; i < header_.e_shnum; ++i) {
      const auto section = at<Elf64_Shdr>(octets_, header_.e_shoff + i * sizeof(Elf64_Shdr));
      if (!section || section->sh_type != SHT_SYMTAB) continue;
      const auto strings = at<Elf64_Shdr>(octets_, header_.e_shoff + section->sh_link * sizeof(Elf64_Shdr));
      if (!strings || strings->sh_offset > octets_.size()) continue;
      const std::string_view names = octets_.substr(strings->sh_offset, strings->sh_size);
      const std::uint64_t size = std::min<std::uint64_t>(section->sh_size, octets_.size());
      for (std::uint64_t offset = 0; offset < size; offset += sizeof(Elf64_Sym)) {
        const auto symbol = at<Elf64_Sym>(octets_, section->sh_offset + offset);
        if (!symbol || ELF64_ST_TYPE(symbol->st_info) != STT_FUNC || symbol->st_name >= names.size()) continue;
        const std::string_view name = names.substr(symbol->st_name, 200);
        file_.functions.push_back(
            {symbol->st_value, symbol->st_size, std::string(name.substr(0, name.find('\0')))});
      }
    }
    std::stable_sort(file_.functions.begin(), file_.functions.end(),
                     [](const ElfFile::Function& a, const ElfFile::Function& b) { return a.offset < b.offset; });
  }

  std::string_view octets_;
  const std::string& name_;
  ElfFile file_;
  Elf64_Ehdr header_{};
  ElfFile::Range dynamic_;
  std::uint64_t rela_ = 0, rela_size_ = 0, plt_ = 0, plt_size_ = 0, symbols_ = 0;
  std::vector<std::uint64_t> places_;
};

}  // namespace

ElfFile ElfFile::parse(std::string_view octets, const std::string& name) { return Parser(octets, name).parse(); }

std::uint64_t ElfFile::unused_octets() const {
  std::uint64_t last = 0;
  for (const Segment& segment : segments) {
    if (segment.writable) last = std::max(last, segment.range.last + kSlackOctets);
  }
  return page_up(last) - last;
}

std::string ElfFile::function_at(std::uint64_t offset) const {
  auto after = std::upper_bound(functions.begin(), functions.end(), offset,
                                [](std::uint64_t value, const Function& f) { return value < f.offset; });
  while (after != functions.begin()) {
    --after;
    // The compiler calls parts and copies of a function f f.cold, f.constprop.0 and so on.
    if (offset - after->offset < after->size) return after->name.substr(0, after->name.find('.'));
    if (offset - after->offset > kMostOctets) break;
  }
  return "";
}

}  // namespace kilotwin::behaviours
