// The run directory holds what robots print, the same for every division of the run.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <memory>

#include "core/dds/dds.hpp"
#include "tests/system/own_domain.hpp"
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

TEST(Printing, TextThatWaitsAtTheEndIsWrittenOrFailsTheRun) {
  // Each robot prints once, at the start. The text waits until the end of the run, because nothing is printed later.
  const Scratch scratch;
  write(scratch.path() / "once.c",
        "#define DEBUG\n#include <kilolib.h>\n#include <debug.h>\n"
        "static void setup(void) { printf(\"ready\\n\"); }\nstatic void loop(void) {}\n"
        "int main(void) { kilo_init(); debug_init(); kilo_start(setup, loop); return 0; }\n");
  for (const std::string kind : {"native", "avr"}) {
    SCOPED_TRACE(kind);
    write(scratch.path() / (kind + ".txtpb"), "duration_s: 0.3 robots { count: 1 behaviour: \"once.c\" avr: " +
                                                  std::string(kind == "avr" ? "true" : "false") + " layout {} }\n");
    const std::string run = scratch / kind;
    const Outcome prepared = kilotwin({"run", scratch / (kind + ".txtpb"), "--prepare", "--out", run}, scratch);
    ASSERT_EQ(prepared.status, 0) << prepared.err;
    write(run + "/logs", "a file in place of the folder");
    const OwnDomain domain;
    const auto service = [&](const std::string& name, Words more) {
      fs::create_directories(scratch.path() / (kind + name));
      Words words{program(), "service", name, "--run", run, "--domain", domain.name};
      words.insert(words.end(), more.begin(), more.end());
      return std::make_unique<Process>(words, scratch.path() / (kind + name));
    };
    const auto physics = service("physics", {"--partition", "0,0"}),
               behaviours = service("behaviours", {"--share", "1/1"}), radio = service("radio", {}),
               station = service("station", {});
    const Outcome outcome = (kind == "avr" ? radio : behaviours)->wait();
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("logs/robot-00000.txt: cannot be created"), std::string::npos) << outcome.err;
    EXPECT_EQ(station->wait().status, 1) << "the run has failed";
  }
}

}  // namespace
}  // namespace kilotwin::test
