// Variables of compiled programs, by name, natively and for the AVR.
#include "services/behaviours/program_variables.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

constexpr const char* kBody = R"(
#include <stdbool.h>
typedef enum { CALM, ALARMED = 200 } mood_t;
typedef struct { uint16_t distance; int8_t bearing; union { uint8_t low; uint8_t high; }; } neighbour_t;
struct { mood_t mood; unsigned low : 3; signed tilt : 5; float speed; neighbour_t seen[2]; } state;
static volatile int32_t hops = -7;
uint8_t table[2][3] = {{1, 2, 3}, {4, 5, 6}};
neighbour_t first;
neighbour_t* nearest = &first;
double ratio = 0.25;
bool lit;
void loop() { static volatile uint16_t count = 3; ++count; state.low = count; state.tilt = -2; state.speed += nearest->distance;
  hops += table[count % 2][count % 3]; lit = ratio > 1; state.mood = ALARMED; state.seen[1].bearing = -1; }
void setup() { static volatile uint16_t count = 9; ++count; }
)";

std::string native() {
  static const Folder folder;
  static const std::string elf = os::read_file(compile({folder.write("program.c", program(kBody))}, cached()).file);
  return elf;
}

std::string firmware() {
  static const Folder folder;
  static const std::string elf =
      os::read_file(compile_firmware({folder.write("program.c", program(kBody))}, cached()).file);
  return elf;
}

std::vector<ScalarVariable> find(const std::string& elf, const std::string& path) {
  return find_variable(elf, VariablePath::parse(path));
}

std::string refusal(const std::string& elf, const std::string& path) {
  try {
    static_cast<void>(find(elf, path));
  } catch (const UserError& error) {
    return error.what();
  }
  return "none";
}

using Kind = ScalarVariable::Kind;

void expect_types(const std::string& elf, std::uint32_t double_octets) {
  const auto hops = find(elf, "hops");
  ASSERT_EQ(hops.size(), 1u);
  EXPECT_EQ(hops[0].octets, 4u);
  EXPECT_EQ(hops[0].kind, Kind::kSigned);
  const auto ratio = find(elf, "ratio");
  ASSERT_EQ(ratio.size(), 1u);
  EXPECT_EQ(ratio[0].kind, Kind::kFloat);
  EXPECT_EQ(ratio[0].octets, double_octets);
  const auto table = find(elf, "table");
  ASSERT_EQ(table.size(), 6u);
  EXPECT_EQ(table[4].name, "table[1][1]");
  EXPECT_EQ(table[4].address, table[0].address + 4);
  EXPECT_EQ(find(elf, "table[1]").size(), 3u);
  const auto tilt = find(elf, "state.tilt");
  ASSERT_EQ(tilt.size(), 1u);
  EXPECT_EQ(tilt[0].bits, 5u);
  EXPECT_EQ(tilt[0].bit_offset, 3u);
  EXPECT_EQ(tilt[0].kind, Kind::kSigned);
  const auto bearing = find(elf, "state.seen[1].bearing"), seen = find(elf, "state.seen");
  ASSERT_EQ(seen.size(), 8u) << "two members of the unnamed union count";
  EXPECT_EQ(bearing[0].address, seen[5].address);
  EXPECT_EQ(find(elf, "state.seen[1].high")[0].address, bearing[0].address + 1);
  const auto distance = find(elf, "nearest->distance");
  ASSERT_EQ(distance.size(), 1u);
  EXPECT_EQ(distance[0].address, 0u) << "the first member, relative to what the pointer points to";
  EXPECT_GT(distance[0].pointer_octets, 0u);
  EXPECT_EQ(find(elf, "loop::count")[0].name, "loop::count");
  EXPECT_NE(find(elf, "loop::count")[0].address, find(elf, "setup::count")[0].address);
  EXPECT_TRUE(find(elf, "hop").empty());
  EXPECT_NE(refusal(elf, "count").find("::count"), std::string::npos) << refusal(elf, "count");
  EXPECT_NE(refusal(elf, "nearest").find("nearest->x"), std::string::npos);
  EXPECT_NE(refusal(elf, "state.spead").find("speed"), std::string::npos) << "the fields that it has";
  EXPECT_NE(refusal(elf, "table[2]").find("has 2 elements"), std::string::npos);
  EXPECT_NE(refusal(elf, "hops.x").find("no struct"), std::string::npos);
}

TEST(ProgramVariables, NativeProgramsHaveTheirTypes) { expect_types(native(), 8); }
TEST(ProgramVariables, FirmwareHasItsTypes) { expect_types(firmware(), 4); }

TEST(ProgramVariables, NamesAreThoseOfTheProgramItself) {
  const auto names = variable_names(native());
  EXPECT_NE(std::find(names.begin(), names.end(), "hops"), names.end());
  EXPECT_NE(std::find(names.begin(), names.end(), "loop::count"), names.end());
  EXPECT_EQ(std::find(names.begin(), names.end(), "kilo_ticks"), names.end())
      << "that of the runtime is not listed";
  EXPECT_EQ(find(native(), "kilo_ticks").size(), 1u) << "but can be recorded";
}

TEST(ProgramVariables, WhatTheCompilerDropsIsSaid) {
  const Folder folder;
  const auto file =
      compile({folder.write("program.c", program("static int unread; void loop() { ++unread; }"))}, cached()).file;
  const std::string elf = os::read_file(file);
  const std::string why = refusal(elf, "unread");
  EXPECT_TRUE(why.find("volatile") != std::string::npos || (why == "none" && find(elf, "unread").size() == 1))
      << why;
}

TEST(ProgramVariables, WhatTheLinkerLeavesOutIsSaid) {
  const Folder folder;
  const auto source = folder.write("program.c", program("volatile uint8_t unused = 3; void loop() {}"));
  for (const auto& file : {compile({source}, cached()).file, compile_firmware({source}, cached()).file}) {
    const std::string elf = os::read_file(file);
    EXPECT_NE(refusal(elf, "unused").find("keeps unused nowhere"), std::string::npos) << refusal(elf, "unused");
    const auto names = variable_names(elf);
    EXPECT_EQ(std::find(names.begin(), names.end(), "unused"), names.end());
  }
}

/// Damaged files give an error or a result, and no crash.
TEST(ProgramVariables, DamagedFilesAreSurvived) {
  std::mt19937_64 random(22);
  const std::string whole = native();
  for (int i = 0; i < 300; ++i) {
    std::string damaged = whole;
    const std::size_t from = random() % damaged.size();
    for (std::size_t k = 0; k < 64 && from + k < damaged.size(); ++k)
      damaged[from + k] = static_cast<char>(random());
    if (i % 7 == 0) damaged.resize(random() % damaged.size());
    for (const char* path : {"state", "table[1][2]", "nearest->distance", "loop::count"})
      static_cast<void>(refusal(damaged, path));
    static_cast<void>(variable_names(damaged));
  }
}

TEST(VariablePath, ReadsWhatItWrites) {
  const auto path = VariablePath::parse("loop::table[3].x");
  EXPECT_EQ(path.function, "loop");
  EXPECT_EQ(path.name, "table");
  ASSERT_EQ(path.steps.size(), 2u);
  EXPECT_EQ(path.steps[0].index, 3u);
  EXPECT_EQ(path.steps[1].field, "x");
  for (const char* wrong :
       {"", "3x", "a.", "a[", "a[]", "a[x]", "a[1", "a->", "a::", "a b", "a[99999999999999999999]"})
    EXPECT_THROW(static_cast<void>(VariablePath::parse(wrong)), UserError) << wrong;
}

TEST(VariablePath, AnyTextIsReadOrRefused) {
  std::mt19937_64 random(7);
  const std::string alphabet = "ab_0[]9.->:: \xff";
  int read = 0;
  for (int i = 0; i < 200'000; ++i) {
    std::string text;
    for (std::size_t n = random() % 12; n > 0; --n) text += alphabet[random() % alphabet.size()];
    try {
      static_cast<void>(VariablePath::parse(text));
      ++read;
    } catch (const UserError&) {}
  }
  EXPECT_GT(read, 100);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
