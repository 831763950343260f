// The run directory holds what robots print, the same for every division of the run.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

/// The robots' logs of a run, by name.
std::map<std::string, std::string> logs(const fs::path& run) {
  std::map<std::string, std::string> result;
  for (const auto& entry : fs::directory_iterator(run / "logs")) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("robot-")) continue;
    std::ifstream stream(entry.path());
    result[name] = {std::istreambuf_iterator<char>(stream), {}};
  }
  return result;
}

TEST(Printing, IsTheSameInOneProcessAndInMany) {
  const Scratch scratch;
  write(
      scratch.path() / "talk.c",
      "#define DEBUG\n#include <kilolib.h>\n#include <debug.h>\n"
      "static message_t m; static message_t* tx(void) { m.crc = message_crc(&m); return &m; }\n"
      "static void rx(message_t* r, distance_measurement_t* d) { printf(\"heard %u\\n\", estimate_distance(d)); }\n"
      "static void setup(void) { printf(\"robot %u\\n\", kilo_uid); }\n"
      "static void loop(void) { if (kilo_ticks % 30 == 0) fprintf(stderr, \"at %lu\\n\", (unsigned "
      "long)kilo_ticks); }\n"
      "int main(void) { kilo_init(); debug_init(); kilo_message_tx = tx; kilo_message_rx = rx; kilo_start(setup, "
      "loop); return 0; }\n");
  write(scratch.path() / "talk.txtpb",
        "duration_s: 4 robots { count: 9 behaviour: \"talk.c\" loop_rate: ONCE_PER_TICK layout { grid { pitch_mm: "
        "50 } } }\n"
        "robots { count: 1 behaviour: \"talk.c\" avr: true layout { x_mm: 150 } }\n");
  const Words words{scratch / "talk.txtpb"};
  const auto with = [&](const Words& more, const std::string& name) {
    Words all = words;
    all.insert(all.end(), more.begin(), more.end());
    (void)run(all, scratch, name);
    return logs(scratch.path() / name);
  };
  const auto local = with({"--mode", "local"}, "local");
  ASSERT_EQ(local.size(), 10u);
  for (const auto& [name, text] : local) {
    EXPECT_NE(text.find("robot " + std::to_string(std::stoi(name.substr(6)))), std::string::npos) << name << text;
    EXPECT_NE(text.find("heard "), std::string::npos) << name;
  }
  EXPECT_EQ(local, with({"--hosts", "3", "--partitions", "2x1"}, "federated"));
}

}  // namespace
}  // namespace kilotwin::test
