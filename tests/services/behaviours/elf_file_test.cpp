#include "services/behaviours/elf_file.hpp"

#include <elf.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/random/random.hpp"
#include "services/behaviours/image.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

std::string valid() {
  return os::read_if_there(compile({std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c"}, cached()).file).value();
}

TEST(ElfFile, DescribesAProgram) {
  const ElfFile file = ElfFile::parse(valid(), "disperse.so");
  EXPECT_LT(file.data.last - file.data.first, 400u);
  EXPECT_LT(file.unused_octets(), 64u) << "its memory ends where a page does";
  EXPECT_EQ(file.pad.first % kPage, 0u);
  EXPECT_LT(file.pad.last - file.pad.first, kPage);
  EXPECT_EQ(file.function_at(file.table.interrupts), "interrupts");
  EXPECT_EQ(file.function_at(file.table.leave + 1), "kt_leave");
}

TEST(ElfFile, NamesTheLinesOfFunctions) {
  const ElfFile file = ElfFile::parse(valid(), "disperse.so");
  for (const char* const name : {"setup", "loop"}) {
    const auto function = std::find_if(file.functions.begin(), file.functions.end(),
                                       [&](const ElfFile::Function& f) { return f.name == name; });
    ASSERT_NE(function, file.functions.end()) << name;
    const auto place = file.lines.find(function->offset);
    ASSERT_TRUE(place) << name;
    EXPECT_EQ(place->file, "disperse.c");
    // The first instruction belongs to a statement of the function, not always to its first one.
    std::istringstream source(os::read_if_there(std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c").value());
    std::uint32_t number = 0, first = 0, last = 0;
    for (std::string line; last == 0 && std::getline(source, line);) {
      ++number;
      if (line.find(std::string("void ") + name + "(") != std::string::npos) first = number;
      if (first != 0 && line == "}") last = number;
    }
    ASSERT_GT(last, first) << name;
    EXPECT_GE(place->line, first) << name;
    EXPECT_LE(place->line, last) << name;
  }
  EXPECT_FALSE(file.lines.find(file.memory.size()));
}

TEST(ElfFile, DamagedLineTablesAreHarmless) {
  const std::string octets = valid();
  const ElfFile file = ElfFile::parse(octets, "disperse.so");
  const std::uint64_t offset = file.table.interrupts;
  // Sections and their headers lie behind the segments.
  const std::size_t first = 2 * kPage;
  ASSERT_GT(octets.size(), first);
  const Random random(11);
  int found = 0, missing = 0;
  for (std::uint32_t round = 0; round < 4000; ++round) {
    LineTables tables{octets};
    const auto draw = random.block(Stream::kLayout, round, Tick{0}, 0);
    for (std::uint32_t n = 0; n <= draw[0] % 8; ++n) {
      const auto change = random.block(Stream::kLayout, round, Tick{1}, n);
      tables.elf[first + change[0] % (octets.size() - first)] = static_cast<char>(change[1] & 0xff);
    }
    if (draw[1] % 8 == 0) tables.elf.resize(draw[2] % octets.size());
    ++(tables.find(offset) ? found : missing);
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(missing, 100);
}

TEST(ElfFile, ReportsEveryTruncation) {
  const std::string octets = valid();
  for (std::size_t size = 0; size < octets.size(); size += 1 + size / 16) {
    try {
      (void)ElfFile::parse(octets.substr(0, size), "cut.so");
      EXPECT_GT(size, 2 * kPage);  // octets behind the segments serve only debuggers
    } catch (const UserError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("cut.so: not a program for simulated robots: "))
          << error.what();
    }
  }
}

TEST(ElfFile, DamageIsDetectedOrHarmless) {
  // Change octets of structures: headers, dynamic section, relocations, the table. A file that is still accepted must load into
  // its slots.
  const std::string octets = valid();
  const ElfFile file = ElfFile::parse(octets, "x");
  Elf64_Ehdr header;
  std::memcpy(&header, octets.data(), sizeof header);
  std::vector<std::size_t> places;
  for (std::size_t at = 0; at < sizeof header + header.e_phnum * sizeof(Elf64_Phdr); ++at) places.push_back(at);
  for (std::uint64_t p = 0; p < header.e_phnum; ++p) {
    Elf64_Phdr segment;
    std::memcpy(&segment, octets.data() + header.e_phoff + p * sizeof segment, sizeof segment);
    if (segment.p_flags & PF_X) continue;
    for (std::uint64_t at = 0; at < segment.p_filesz; ++at) places.push_back(segment.p_offset + at);
  }
  const Random random(7);
  int accepted = 0, rejected = 0;
  for (std::uint32_t round = 0; round < 20000; ++round) {
    std::string damaged = octets;
    const auto draw = random.block(Stream::kLayout, round, Tick{0}, 0);
    for (std::uint32_t n = 0; n <= draw[0] % 3; ++n) {
      const auto change = random.block(Stream::kLayout, round, Tick{1}, n);
      static constexpr char kValues[] = {0, 1, 2, 7, 8, 127, -1, -128};
      damaged[places[change[0] % places.size()]] =
          change[1] % 2 == 0 ? kValues[change[2] % 8] : static_cast<char>(change[2] & 0xff);
    }
    try {
      const ElfFile parsed = ElfFile::parse(damaged, "damaged.so");
      ++accepted;
      if (accepted % 20 == 0) {
        const Slot slot(parsed, kFirstAddress);
        EXPECT_EQ(slot.initial_data().size(), parsed.data.last - parsed.data.first);
      }
    } catch (const UserError&) {
      ++rejected;
    }
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(rejected, 1000);
}

TEST(Slot, IsMappedAtItsAddressOnly) {
  const ElfFile file = ElfFile::parse(valid(), "x");
  const Slot slot(file, kFirstAddress);
  EXPECT_EQ(slot.stack_top() % 16, 0u);
  EXPECT_GT(slot.image_address(), kFirstAddress);
  EXPECT_LT(slot.image_address() + file.memory.size(), kFirstAddress + Slot::size(file));
  EXPECT_THROW(Slot(file, kFirstAddress), RunError);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
