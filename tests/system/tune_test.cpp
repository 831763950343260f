// `kilotwin tune`: what is known to be best is found, and what it leaves says so.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

nlohmann::json tuned(const Words& more, const Scratch& scratch, const std::string& experiment,
                     const std::string& budget = "76") {
  Words words{"tune", experiment, "--quiet", "--seeds", "2", "--budget", budget, "--out", scratch / "tune"};
  words.insert(words.end(), more.begin(), more.end());
  const Outcome outcome = kilotwin(words, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_FALSE(fs::exists(scratch / "tune/runs"));
  return nlohmann::json::parse(read(scratch / "tune/tune.json"));
}

TEST(TuneCommand, FindsTheGridThatSpreadsARobotSwarmMost) {
  Scratch scratch;
  const auto json = tuned({"--duration", "1", "--robots", "9", "--vary", "robots.layout.grid.pitch_mm=40.0..120.0",
                           "--maximise", "spread"},
                          scratch, source("experiments/disperse.txtpb"));
  EXPECT_GT(json.at("best").at("robots.layout.grid.pitch_mm"), 110);
  EXPECT_GT(json.at("gain").at("mean"), 0);
  EXPECT_EQ(json.at("gain").at("runs"), 8);
  // The words of the result repeat it.
  Words words = json.at("run");
  words.erase(words.begin());
  const auto out = std::find(words.begin(), words.end(), "--out");
  *(out + 1) = scratch / "again";
  EXPECT_EQ(kilotwin(words, scratch).status, 0);
  // A header, and as many points as the budget allows: less than a generation of 5 points is left of it.
  const std::string points = read(scratch / "tune/points.csv");
  EXPECT_TRUE(points.starts_with("generation,robots.layout.grid.pitch_mm,spread,spread_se,failed\n")) << points;
  EXPECT_GE(std::count(points.begin(), points.end(), '\n'), 1 + 10);
  EXPECT_NE(read(scratch / "tune/report.html").find("robots.layout.grid.pitch_mm"), std::string::npos);
}

TEST(TuneCommand, VariesConstantsOfPrograms) {
  Scratch scratch;
  write(scratch / "walk.c", R"(#include "kilolib.h"
void setup(void) {}
void loop(void) {
  if (kilo_ticks < WALK_TICKS) set_motors(kilo_straight_left, kilo_straight_right);
  else set_motors(0, 0);
}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
)");
  write(scratch / "walk.txtpb",
        "name: \"walk\" duration_s: 3 arena { width_mm: 1000 height_mm: 1000 }\n"
        "robots { count: 4 behaviour: \"walk.c\" layout { grid { pitch_mm: 150 } } }\n");
  const auto json =
      tuned({"--define", "WALK_TICKS=0", "--vary-define", "WALK_TICKS=1..90", "--maximise", "displacement"},
            scratch, scratch / "walk.txtpb");
  EXPECT_GT(json.at("best").at("WALK_TICKS"), 75);
}

TEST(TuneCommand, StrictLeavesOutRunsInWhichRobotsFailed) {
  Scratch scratch;
  write(scratch / "p.c", R"(#include "kilolib.h"
void setup(void) { if (kilo_uid == 2 && LEVEL > 50) *(volatile int*)8 = 1; }
void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
)");
  write(scratch / "e.txtpb",
        "duration_s: 0.2 arena { width_mm: 500 height_mm: 500 }\n"
        "robots { count: 3 behaviour: \"p.c\" layout { grid { pitch_mm: 50 } } }\n");
  const auto tune = [&](const std::string& out, const Words& more) {
    Words words{"tune",
                scratch / "e.txtpb",
                "--quiet",
                "--define",
                "LEVEL=1",
                "--vary-define",
                "LEVEL=1..100",
                "--maximise",
                "spread",
                "--seeds",
                "2",
                "--budget",
                "52",
                "--out",
                scratch / out};
    words.insert(words.end(), more.begin(), more.end());
    return kilotwin(words, scratch);
  };
  const Outcome lenient = tune("lenient", {});
  EXPECT_EQ(lenient.status, 0) << lenient.err;
  EXPECT_NE(lenient.err.find("robots failed in"), std::string::npos) << lenient.err;
  const Outcome strict = tune("strict", {"--strict"});
  EXPECT_EQ(strict.status, 1) << strict.err;
  EXPECT_NE(strict.err.find("--strict left them out"), std::string::npos) << strict.err;
  const auto best = nlohmann::json::parse(read(scratch / "strict/tune.json")).at("best");
  EXPECT_LE(best.at("LEVEL"), 50);
}

TEST(TuneCommand, TheWorstOfSeveralModelsDecides) {
  // Robots drive straight on for 3 s: at 1 mm/s by one model, at 20 mm/s by the other. The worst is the slow one's displacement, and
  // the mean lies halfway between both.
  Scratch scratch;
  fs::create_directory(scratch / "models");
  write(scratch / "models/slow.txtpb", "motion { straight_speed_mm_s: 1 bias_sd_mm_s: 0 }\n");
  write(scratch / "models/fast.txtpb", "motion { straight_speed_mm_s: 20 bias_sd_mm_s: 0 }\n");
  const auto value = [&](bool worst) {
    Words more{"--duration",  "3",
               "--robots",    "4",
               "--behaviour", source("behaviours/straight.c"),
               "--vary",      "robots.layout.grid.pitch_mm=200..210",
               "--maximise",  "displacement",
               "--models"};
    // Files one by one, or all of a directory.
    if (worst)
      more.insert(more.end(), {scratch / "models/slow.txtpb", scratch / "models/fast.txtpb", "--worst"});
    else
      more.push_back(scratch / "models");
    if (fs::exists(scratch / "tune")) fs::remove_all(scratch / "tune");
    return tuned(more, scratch, source("experiments/disperse.txtpb"), "152").at("value").at("mean").get<double>();
  };
  const double of_mean = value(false), of_worst = value(true);
  EXPECT_LT(of_worst, 0.5 * of_mean);
}

TEST(TuneCommand, ErrorsNameTheMistake) {
  Scratch scratch;
  const std::string experiment = source("experiments/disperse.txtpb");
  const auto error = [&](const Words& words) {
    Words all{"tune", experiment, "--out", scratch / "tune"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = kilotwin(all, scratch);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_FALSE(fs::exists(scratch / "tune"));
    return outcome.err;
  };
  EXPECT_NE(error({"--maximise", "spread"}).find("--vary"), std::string::npos);
  EXPECT_NE(error({"--vary", "robots.count=1..9"}).find("--maximise"), std::string::npos);
  EXPECT_NE(error({"--vary", "robots.count=1..9", "--maximise", "beauty"}).find("no observable \"beauty\""),
            std::string::npos);
  EXPECT_NE(error({"--vary", "robots.colour=1..9", "--maximise", "spread"}).find("colour"), std::string::npos);
  EXPECT_NE(error({"--vary", "robots.count=1..9", "--maximise", "spread", "--budget", "10"}).find("at least 104"),
            std::string::npos);
}

}  // namespace
}  // namespace kilotwin::test
