// Sweeps whose runs fail, and sweeps that go on.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class Sweeps : public testing::Test {
 protected:
  Sweeps() {
    write(scratch.path() / "p.c", program_of("1"));
    write(scratch.path() / "m.txtpb", "motion { straight_speed_mm_s: 9 }\n");
    write_experiment("500");
  }
  /// A program that shows a colour.
  static std::string program_of(const std::string& red) {
    return "#include <kilolib.h>\nstatic void setup(void) {}\nstatic void loop(void) { set_color(RGB(" + red +
           ", 0, 0)); }\nint main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n";
  }
  void write_experiment(const std::string& width_mm) const {
    write(scratch.path() / "e.txtpb",
          "duration_s: 1 arena { width_mm: " + width_mm +
              " height_mm: 500 }\nrobots { count: 4 behaviour: \"p.c\" layout { grid { pitch_mm: 50 } } }\n");
  }
  Outcome sweep(const Words& more) const {
    Words words{"sweep", scratch / "e.txtpb"};
    words.insert(words.end(), more.begin(), more.end());
    return kilotwin(words, scratch);
  }
  Scratch scratch;
};

TEST_F(Sweeps, GoOnWithTheSameContentsAlone) {
  const Words model{"--model", scratch / "m.txtpb"}, resume{"--seeds", "1..2", "--resume", scratch / "s"};
  const auto go_on = [&] {
    Words words = model;
    words.insert(words.end(), resume.begin(), resume.end());
    return sweep(words);
  };
  Words first = model;
  first.insert(first.end(), {"--seeds", "1", "--out", scratch / "s"});
  const Outcome begun = sweep(first);
  ASSERT_EQ(begun.status, 0) << begun.err;

  const auto refused_for = [&](const std::string& name) {
    const Outcome outcome = go_on();
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("another content"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(scratch / "s/0000-2"));
  };
  write(scratch.path() / "p.c", program_of("2"));
  refused_for("p.c");
  write(scratch.path() / "p.c", program_of("1"));
  write_experiment("600");
  refused_for("e.txtpb");
  write_experiment("500");
  write(scratch.path() / "m.txtpb", "motion { straight_speed_mm_s: 8 }\n");
  refused_for("m.txtpb");

  write(scratch.path() / "m.txtpb", "motion { straight_speed_mm_s: 9 }\n");
  const Outcome resumed = go_on();
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_NE(resumed.err.find("1 of 2 runs were done before"), std::string::npos) << resumed.err;
  const std::string runs = read(scratch / "s/runs.csv");
  EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), 3) << runs;
}

TEST_F(Sweeps, RankDesignsOverModels) {
  write(scratch.path() / "p.c",
        "#include <kilolib.h>\nstatic void setup(void) {}\nstatic void loop(void) { set_motors(kilo_straight_left, "
        "kilo_straight_right); }\nint main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  fs::create_directory(scratch / "models");
  for (const char* speed : {"5", "10"})
    write(scratch.path() / "models" / (std::string("m") + speed + ".txtpb"),
          std::string("motion { noise: false spin_up_s: 0 straight_speed_mm_s: ") + speed + " }\n");
  const Outcome outcome = sweep({"--models", scratch / "models", "--set", "duration_s=1,2", "--plot",
                                 "displacement", "--goal", "smallest", "--out", scratch / "s"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("difference from rank 1"), std::string::npos) << outcome.out;
  const std::string designs = read(scratch / "s/designs.csv");
  EXPECT_TRUE(designs.starts_with("rank,duration_s,models,displacement,displacement_se,worst,")) << designs;
  EXPECT_NE(designs.find("\n1,1,2,"), std::string::npos) << designs;
  EXPECT_NE(designs.find("\n2,2,2,"), std::string::npos) << designs;
  EXPECT_NE(designs.find("m10.txtpb"), std::string::npos) << "the faster robots are the worst\n" << designs;
  EXPECT_EQ(sweep({"--models", scratch / "models", "--model", scratch / "models/m5.txtpb"}).status, 2);
  fs::create_directory(scratch / "none");
  EXPECT_NE(sweep({"--models", scratch / "none"}).err.find("holds no model file"), std::string::npos);
}

TEST_F(Sweeps, ListTheRunsThatFailedAlsoWhereAllDid) {
  write(scratch.path() / "bad.cpp",
        "#include <kilotwin_station.hpp>\n#include <cstdlib>\nstruct Bad : KilobotExperiment {\n"
        "  void initialise(bool) override {}\n  void run() override { if (time > 1) abort(); }\n};\n"
        "extern \"C\" KilobotExperiment* createExpt() { return new Bad; }\n");
  write(scratch.path() / "e.txtpb",
        read(scratch / "e.txtpb") +
            "station { environment { plugin { source: \"bad.cpp\" on_failure: END_RUN } } }\n");
  const Outcome some = sweep({"--set", "duration_s=0.5,3", "--out", scratch / "some"});
  EXPECT_EQ(some.status, 1) << some.err;
  EXPECT_TRUE(fs::exists(scratch / "some/sweep.csv"));
  const std::string runs = read(scratch / "some/runs.csv");
  EXPECT_NE(runs.find("/0000-1,0,1,1,0.5,"), std::string::npos) << runs;
  EXPECT_NE(runs.find("/0001-1,1,1,0,3,"), std::string::npos) << runs;
  EXPECT_NE(runs.find("plugin bad.cpp failed"), std::string::npos) << runs;

  const Outcome none = sweep({"--duration", "3", "--out", scratch / "none"});
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("no run came to its end"), std::string::npos) << none.err;
  EXPECT_NE(read(scratch / "none/runs.csv").find("plugin bad.cpp failed"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch / "none/sweep.csv"));
}

TEST_F(Sweeps, StrictLeavesOutRunsInWhichRobotsFailed) {
  write(scratch.path() / "p.c",
        "#include <kilolib.h>\nstatic void setup(void) { if (kilo_uid == 3) *(volatile int*)8 = 1; }\n"
        "static void loop(void) {}\nint main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  // Robot 3 fails, where there is one.
  const Words points{"--set", "robots.count=2,4"};
  const auto swept = [&](const Words& more) {
    Words words = points;
    words.insert(words.end(), more.begin(), more.end());
    return sweep(words);
  };
  const Outcome lenient = swept({"--out", scratch / "lenient"});
  EXPECT_EQ(lenient.status, 0) << lenient.err;
  EXPECT_NE(lenient.err.find("robots failed in 1 of 2 runs"), std::string::npos) << lenient.err;
  const Outcome strict = swept({"--strict", "--out", scratch / "strict"});
  EXPECT_EQ(strict.status, 1) << strict.err;
  EXPECT_NE(strict.err.find("1 of 4 robots failed"), std::string::npos) << strict.err;
  EXPECT_EQ(strict.err.find("robots failed in"), std::string::npos) << strict.err;
  EXPECT_NE(read(scratch / "strict/runs.csv").find("/0001-1,1,1,0,4,"), std::string::npos);
  EXPECT_NE(read(scratch / "strict/sweep.csv").find("\nrobots.count=4,0,"), std::string::npos)
      << "no run is in the mean\n"
      << read(scratch / "strict/sweep.csv");
  const std::string before = read(scratch / "strict/runs.csv");
  const Outcome resumed = swept({"--strict", "--resume", scratch / "strict"});
  EXPECT_EQ(resumed.status, 1) << resumed.err;
  EXPECT_EQ(read(scratch / "strict/runs.csv"), before);
  EXPECT_EQ(swept({"--resume", scratch / "strict"}).status, 2) << "another sweep";
}

TEST_F(Sweeps, AxesOfPlotsAreAsTheOptionsSay) {
  const auto plot = [&](const std::string& name, const Words& axes) {
    Words words{"--set", "robots.count=1..4", "--plot", "spread", "--out", scratch / name};
    words.insert(words.end(), axes.begin(), axes.end());
    EXPECT_EQ(sweep(words).status, 0);
    return fs::exists(scratch / (name + "/response.svg")) ? read(scratch / (name + "/response.svg"))
                                                          : std::string();
  };
  const std::string linear = plot("linear", {});
  if (linear.empty()) GTEST_SKIP() << "gnuplot is not installed";
  EXPECT_NE(plot("x", {"--x-axis", "log"}), linear);
  EXPECT_EQ(plot("same", {"--x-axis", "linear", "--y-axis", "linear"}), linear);
  EXPECT_EQ(sweep({"--y-axis", "logarithmic"}).status, 2);
}

}  // namespace
}  // namespace kilotwin::test
