// A program that brings down its host costs its own robot: the run starts again without it, and comes to the same end.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

class Recoveries : public testing::Test {
 protected:
  /// A program of which robot 3 does `deed` when its clock shows 60; all wait in delays and in loops.
  std::string behaviour(const std::string& name, const std::string& deed) const {
    std::ofstream(scratch / (name + ".c"))
        << "#include <kilolib.h>\n"
           "static uint8_t heard; static message_t m;\n"
           "static void rx(message_t* r, distance_measurement_t* d) { ++heard; }\n"
           "static message_t* tx(void) { return &m; }\n"
           "static void setup(void) { m.crc = message_crc(&m); }\n"
           "static void loop(void) { uint8_t h = heard; if (kilo_uid % 2) while (heard == h); else delay(70);\n"
           "  set_color(heard); set_motors(heard, 70); }\n"
           "static void deed(void) { "
        << deed
        << " }\n"
           "static void wait(void) { if (kilo_uid == 3 && kilo_ticks >= 60) deed(); if (kilo_uid != 3) loop(); }\n"
           "int main(void) { kilo_init(); kilo_message_rx = rx; kilo_message_tx = tx; kilo_start(setup, wait); }\n";
    return scratch / (name + ".c");
  }
  recorder::Summary outcome(const std::string& name, const std::string& program, const Words& more) const {
    Words words{source("experiments/disperse.txtpb"), "--duration", "4", "--robots", "16", "--behaviour", program};
    words.insert(words.end(), more.begin(), more.end());
    return run(words, scratch, name);
  }
  Scratch scratch;
};

TEST_F(Recoveries, AHostBroughtDownCostsTheCulpritAlone) {
  // By system calls, getpid and kill, as no wild pointer finds its host for certain.
  const std::string kills =
      behaviour("kills",
                "long p; __asm__ volatile(\"syscall\" : \"=a\"(p) : \"a\"(39) : \"rcx\", \"r11\", \"memory\");\n"
                "__asm__ volatile(\"syscall\" : \"=a\"(p) : \"a\"(62), \"D\"(p), \"S\"(6) : \"rcx\", \"r11\", "
                "\"memory\"); for (;;) {}");
  const std::string faults = behaviour("faults", "*(volatile int*)8 = 1;");
  const auto failed = outcome("failed", faults, {"--mode", "local"});
  EXPECT_EQ(failed.robots_failed, 1u);
  EXPECT_EQ(failed.recoveries, 0u);
  const auto recovered = outcome("recovered", kills, {"--partitions", "2x1", "--hosts", "2"});
  EXPECT_EQ(recovered.robots_failed, 1u);
  EXPECT_EQ(recovered.recoveries, 1u);
  EXPECT_EQ(recovered.state_hash, failed.state_hash);
  EXPECT_EQ(recovered.ticks, failed.ticks);
}

}  // namespace
}  // namespace kilotwin::test
