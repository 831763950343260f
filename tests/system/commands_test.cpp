// Every command, from its arguments to its files.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "clients/recorder/reader.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class Commands : public testing::Test {
 protected:
  Words small(const Words& more = {}) const {
    Words words{source("experiments/disperse.txtpb"), "--duration", "3", "--robots", "20", "--mode", "local"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Scratch scratch;
};

TEST_F(Commands, CheckPrintsNothingForValidExperiments) {
  for (const auto& entry : fs::directory_iterator(source("experiments"))) {
    if (entry.path().extension() != ".txtpb") continue;
    const Outcome outcome = kilotwin({"check", entry.path().string()}, scratch);
    EXPECT_EQ(outcome.status, 0) << entry.path();
    EXPECT_EQ(outcome.out + outcome.err, "");
  }
}

TEST_F(Commands, RunWritesTheFilesOfTheContract) {
  run(small(), scratch, "run");
  const auto summary = nlohmann::json::parse(read(scratch / "run/summary.json"));
  for (const char* field : {"name", "seed", "mode", "partitions", "robots", "ticks", "simulated_s", "start_s",
                            "wall_s", "realtime_factor", "state_hash", "messages", "robots_failed", "recoveries"}) {
    EXPECT_TRUE(summary.contains(field)) << field;
  }
  EXPECT_EQ(summary["robots"], 20);
  EXPECT_EQ(summary["state_hash"].get<std::string>().size(), 16u);
  EXPECT_GT(summary["messages"]["received"].get<int>(), 0);
  for (const char* file : {"recording.ktrec", "experiment.txtpb", "picture.svg", "manifest.pb"})
    EXPECT_TRUE(fs::exists(scratch.path() / "run" / file)) << file;
}

TEST_F(Commands, MacrosMayFollowOneDefine) {
  write(scratch / "p.c",
        "#include <kilolib.h>\nstatic void setup(void) {}\nstatic void loop(void) { set_color(RGB(RED, GREEN, 0)); "
        "}\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  run(small({"--behaviour", scratch / "p.c", "--define", "RED=3", "GREEN=1"}), scratch, "run");
  Words words = small({"--behaviour", scratch / "p.c", "--define", "RED=3"});
  words.insert(words.begin(), "run");
  const Outcome outcome = kilotwin(words, scratch);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--define GREEN=VALUE"), std::string::npos) << outcome.err;
}

TEST_F(Commands, ExportWritesTrajectoriesAndMessages) {
  run(small({"--set", "recording.messages=true"}), scratch, "run");
  const Outcome outcome = kilotwin(
      {"export", scratch / "run", "--trajectories", scratch / "t.csv", "--messages", scratch / "m.csv"}, scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::string trajectories = read(scratch / "t.csv");
  EXPECT_EQ(trajectories.substr(0, trajectories.find('\n')),
            "time_s,robot,x_mm,y_mm,heading_rad,led_r,led_g,led_b,group,state,failed");
  EXPECT_EQ(std::count(trajectories.begin(), trajectories.end(), '\n'), 1 + 20 * 4);
  const std::string messages = read(scratch / "m.csv");
  EXPECT_EQ(messages.substr(0, messages.find('\n')), "receiver,sender,count,sent_if_receiver_is_sender");
}

TEST_F(Commands, ExportWritesGzipAndToStandardOutput) {
  run(small(), scratch, "run");
  ASSERT_EQ(kilotwin({"export", scratch / "run", "--trajectories", scratch / "t.csv"}, scratch).status, 0);
  ASSERT_EQ(kilotwin({"export", scratch / "run", "--trajectories", scratch / "t.csv.gz"}, scratch).status, 0);
  EXPECT_EQ(read(scratch / "t.csv.gz").substr(0, 2), "\x1f\x8b");
  const Outcome piped = kilotwin({"export", scratch / "run", "--trajectories", "-"}, scratch);
  EXPECT_EQ(piped.status, 0) << piped.err;
  EXPECT_EQ(piped.out, read(scratch / "t.csv"));
  EXPECT_FALSE(fs::exists("-"));
  const Outcome two = kilotwin({"export", scratch / "run", "--trajectories", "-", "--radio", "-"}, scratch);
  EXPECT_EQ(two.status, 2);
  EXPECT_NE(two.err.find("standard output"), std::string::npos) << two.err;
}

TEST_F(Commands, ARunNamesItsBuildItsTimeAndItsPlace) {
  run(small({"--seed", "4"}), scratch, "run");
  const auto summary = nlohmann::json::parse(read(scratch / "run/summary.json"));
  for (const char* field : {"version", "build", "host", "date"})
    EXPECT_FALSE(summary[field].get<std::string>().empty());
  EXPECT_GE(summary["cores"].get<int>(), 1);
  const std::string date = summary["date"];
  ASSERT_EQ(date.size(), 20u) << date;
  EXPECT_EQ(date[10], 'T');
  EXPECT_EQ(date.back(), 'Z');
  const auto words = summary["command_line"].get<Words>();
  ASSERT_GT(words.size(), 3u);
  EXPECT_EQ(words[1], "run");
  EXPECT_NE(std::find(words.begin(), words.end(), "--seed"), words.end());
}

TEST_F(Commands, MessagesOfAFederatedRunAreThoseOfALocalOne) {
  run(small({"--set", "recording.messages=true"}), scratch, "local");
  Words words = small({"--set", "recording.messages=true", "--partitions", "2x1"});
  words[6] = "federated";
  run(words, scratch, "federated");
  for (const char* name : {"local", "federated"}) {
    ASSERT_EQ(
        kilotwin({"export", scratch / name, "--messages", scratch / (std::string(name) + ".csv")}, scratch).status,
        0);
  }
  EXPECT_GT(read(scratch / "local.csv").size(), 100u);
  EXPECT_EQ(read(scratch / "local.csv"), read(scratch / "federated.csv"));
}

TEST_F(Commands, ReplayVerifiesAndFindsTheFirstDifference) {
  run(small(), scratch, "run");
  EXPECT_EQ(kilotwin({"replay", scratch / "run", "--verify"}, scratch).status, 0);
  // With the recording of another run, the first state hash differs.
  run(small({"--seed", "2"}), scratch, "other");
  fs::copy_file(scratch / "other/recording.ktrec", scratch / "run/recording.ktrec",
                fs::copy_options::overwrite_existing);
  fs::copy_file(scratch / "other/summary.json", scratch / "run/summary.json", fs::copy_options::overwrite_existing);
  const Outcome differs = kilotwin({"replay", scratch / "run", "--verify"}, scratch);
  EXPECT_EQ(differs.status, 1);
  EXPECT_NE(differs.err.find("first tick that differs"), std::string::npos) << differs.err;
}

TEST_F(Commands, ATruncatedRecordingIsReadUpToItsEnd) {
  run(small(), scratch, "run");
  const std::string file = scratch / "run/recording.ktrec";
  fs::resize_file(file, fs::file_size(file) * 2 / 3);
  const Outcome outcome = kilotwin({"export", scratch / "run", "--trajectories", scratch / "t.csv"}, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("cut off"), std::string::npos) << outcome.err;
  EXPECT_GT(read(scratch / "t.csv").size(), 500u);
}

TEST_F(Commands, BuildMakesAProgramThatRuns) {
  ASSERT_EQ(kilotwin({"build", source("behaviours/disperse.c"), "-o", scratch / "d.so"}, scratch).status, 0);
  const auto built = run(small({"--behaviour", scratch / "d.so"}), scratch, "built");
  EXPECT_EQ(built.state_hash, run(small(), scratch, "compiled").state_hash);
}

TEST_F(Commands, BuildWithoutAFileLeavesNothingWhereOneStands) {
  const Scratch here;
  const Outcome outcome = kilotwin({"build", source("behaviours/disperse.c")}, here);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("-o FILE"), std::string::npos) << outcome.out;
  for (const fs::directory_entry& entry : fs::directory_iterator(here.path()))
    EXPECT_NE(entry.path().extension(), ".so") << entry.path();
}

TEST_F(Commands, BuildForTheRealRobotPrintsSizes) {
  const Outcome outcome = kilotwin({"build", source("behaviours/disperse.c"), "--avr"}, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("ATmega328P"), std::string::npos) << outcome.out;
  // Two files share an uninitialised array of 1000 octets.
  write(scratch / "a.c", "char shared[1000];\nvoid other(void);\nint main(void) { other(); return 0; }\n");
  write(scratch / "b.c", "char shared[1000];\nvoid other(void) { shared[0] = 1; }\n");
  EXPECT_NE(kilotwin({"build", scratch / "a.c", scratch / "b.c", "--avr"}, scratch).out.find(" 1000 octets of RAM"),
            std::string::npos);
  // The second file is found, and what the robot computes differently is said.
  write(
      scratch / "c.c",
      "#include <kilolib.h>\nvoid other(void);\nuint8_t s;\nuint32_t t;\nstatic void loop(void) { other(); t = s * "
      "1000; }\nint main(void) { kilo_init(); kilo_start(loop, loop); return 0; }\n");
  const Outcome warned = kilotwin({"build", scratch / "c.c", "--avr"}, scratch);
  EXPECT_NE(warned.out.find(" octets of RAM"), std::string::npos) << warned.err;
  EXPECT_NE(warned.err.find("b.c: compiled too"), std::string::npos) << warned.err;
  EXPECT_NE(warned.err.find("c.c:5:"), std::string::npos) << warned.err;
}

TEST_F(Commands, TheExperimentAsRunRunsAgain) {
  write(scratch / "poses.csv", "x_mm,y_mm,heading_rad\n0,0,0\n60,0,1\n");
  write(scratch / "part.h", "#define COLOUR RGB(0, 2, 0)\n");
  write(scratch / "p.c",
        "#include <kilolib.h>\n#include \"part.h\"\nvoid setup(void) { set_color(COLOUR); set_motors(SPEED, "
        "SPEED); }\n"
        "void loop(void) {}\nint main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  write(scratch / "e.txtpb",
        "duration_s: 3\nrobots { behaviour: \"p.c\" layout { poses { csv: \"poses.csv\" } } }\n");
  const auto first =
      run({scratch / "e.txtpb", "--mode", "local", "--define", "SPEED=60", "--set", "motion.noise=false"}, scratch,
          "first");
  for (const char* file : {"e.txtpb", "poses.csv", "part.h", "p.c"}) fs::remove(scratch.path() / file);
  const auto again = run({scratch / "first/experiment.txtpb", "--mode", "local"}, scratch, "again");
  EXPECT_EQ(again.state_hash, first.state_hash);
  EXPECT_EQ(again.name, "e");
}

TEST_F(Commands, SeedsAreDecimalAndReachTheWholeRange) {
  EXPECT_EQ(run(small({"--seed", "010"}), scratch, "zeros").seed, 10u);
  EXPECT_EQ(run(small({"--seed", "18446744073709551615"}), scratch, "last").seed, 18446744073709551615u);
}

TEST_F(Commands, DefineReachesTheProgram) {
  write(scratch / "p.c",
        "#include <kilolib.h>\nvoid setup(void) { set_color(COLOUR); }\nvoid loop(void) {}\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  run(small({"--behaviour", scratch / "p.c", "--define", "COLOUR=RGB(3,0,1)"}), scratch, "run");
  ASSERT_EQ(kilotwin({"export", scratch / "run", "--trajectories", scratch / "t.csv"}, scratch).status, 0);
  EXPECT_NE(read(scratch / "t.csv").find(",3,0,1,0,running,0\n"), std::string::npos);
}

TEST_F(Commands, AModelFileGivesARobotItsOwnBias) {
  write(scratch / "m.txtpb", "motion { bias_sd_mm_s: 0 bias_mean_mm_s: 0 }\n");
  const auto plain = run(small({"--model", scratch / "m.txtpb"}), scratch, "plain");
  write(scratch / "own.txtpb",
        "motion { bias_sd_mm_s: 0 bias_mean_mm_s: 0 } robot { robot: 3 bias_left_mm_s: 1 bias_right_mm_s: -1 }\n");
  EXPECT_NE(run(small({"--model", scratch / "own.txtpb"}), scratch, "own").state_hash, plain.state_hash);
}

TEST_F(Commands, SweepTabulatesAllCombinations) {
  const Outcome outcome =
      kilotwin({"sweep", source("experiments/disperse.txtpb"), "--robots", "9", "--duration", "2", "--seeds",
                "1..3", "--set", "robots.layout.grid.pitch_mm=40,60", "--out", scratch / "sweep"},
               scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("robots.layout.grid.pitch_mm=60"), std::string::npos) << outcome.out;
  const std::string csv = read(scratch / "sweep/sweep.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3);
  // The legend names the field once, and a value per curve.
  const std::string plot = read(scratch / "sweep/sweep.svg");
  EXPECT_NE(plot.find("robots.layout.grid.pitch_mm:"), std::string::npos);
  EXPECT_EQ(plot.find("pitch_mm=40"), std::string::npos);
  EXPECT_NE(plot.find(">40<"), std::string::npos);
  const std::string page = read(scratch / "sweep/report.html");
  for (const char* text :
       {"<h1>disperse</h1>", "data:image/svg+xml;base64,", "robots.layout.grid.pitch_mm=60</td>", "--seeds"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
}

TEST_F(Commands, ASweepOfOneValueNeedsNoLegend) {
  const Outcome outcome =
      kilotwin({"sweep", source("experiments/disperse.txtpb"), "--robots", "9", "--duration", "2", "--seeds",
                "1..2", "--set", "robots.layout.grid.pitch_mm=40", "--out", scratch / "sweep"},
               scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // The value stands in the subtitle alone.
  const std::string plot = read(scratch / "sweep/sweep.svg");
  const std::size_t first = plot.find("robots.layout.grid.pitch_mm=40");
  EXPECT_NE(first, std::string::npos);
  EXPECT_EQ(plot.find("pitch_mm=40", first + 30), std::string::npos);
}

TEST_F(Commands, SweepOverARangeOfNumbersPlotsTheResponse) {
  const Outcome outcome = kilotwin({"sweep", source("experiments/diffusion.txtpb"), "--duration", "3", "--set",
                                    "physics.sub_steps=1..4", "--plot", "spread", "--out", scratch / "sweep"},
                                   scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(read(scratch / "sweep/response.svg").find("physics.sub_steps"), std::string::npos);
  // Of each point the states at 0, 1, 2 and 3 s, and a header.
  const std::string curves = read(scratch / "sweep/curves.csv");
  EXPECT_EQ(std::count(curves.begin(), curves.end(), '\n'), 1 + 4 * 4);
  EXPECT_NE(curves.find("\nphysics.sub_steps=4,0,1,0,"), std::string::npos) << curves;
  EXPECT_EQ(kilotwin({"sweep", source("experiments/diffusion.txtpb"), "--plot", "speed"}, scratch).status, 2);
}

TEST_F(Commands, AnInterruptedSweepReportsTheRunsThatEnded) {
  // The first runs are short, the later ones would take minutes.
  Process sweep({program(), "sweep", source("experiments/diffusion.txtpb"), "--set", "duration_s=1,1000000",
                 "--seeds", "1..2", "--jobs", "2", "--out", scratch / "sweep"},
                scratch.path());
  ASSERT_TRUE(eventually([&] {
    return fs::exists(scratch / "sweep/0000-1/summary.json") && fs::exists(scratch / "sweep/0000-2/summary.json") &&
           fs::exists(scratch / "sweep/0001-2/recording.ktrec");
  }));
  sweep.signal(SIGINT);
  const Outcome outcome = sweep.wait();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("interrupted; 2 of 4 runs were done"), std::string::npos) << outcome.err;
  EXPECT_NE(read(scratch / "sweep/sweep.csv").find("\nduration_s=1,2,"), std::string::npos);
  EXPECT_TRUE(processes_with(scratch / "sweep").empty());
}

TEST_F(Commands, SweepRefusesAPointThatCannotRunBeforeTheFirstRun) {
  const Outcome outcome = kilotwin({"sweep", source("experiments/disperse.txtpb"), "--duration", "1", "--set",
                                    "robots.count=9,5000", "--out", scratch / "sweep"},
                                   scratch);
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_FALSE(fs::exists(scratch / "sweep"));
}

TEST_F(Commands, SweepReachesTheLastSeed) {
  const Outcome outcome =
      kilotwin({"sweep", source("experiments/disperse.txtpb"), "--robots", "4", "--duration", "1", "--seeds",
                "18446744073709551614..18446744073709551615", "--out", scratch / "sweep"},
               scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(scratch / "sweep/0000-18446744073709551615/summary.json"));
}

TEST_F(Commands, DoctorFindsThisMachineFit) {
  const Outcome outcome = kilotwin({"doctor"}, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.out;
  EXPECT_NE(outcome.out.find("experiments will run here"), std::string::npos);
}

TEST_F(Commands, HelpIsEverywhere) {
  for (const char* command :
       {"run", "service", "sweep", "check", "build", "export", "replay", "identify", "config", "doctor"}) {
    const Outcome outcome = kilotwin({command, "--help"}, scratch);
    EXPECT_EQ(outcome.status, 0) << command;
    EXPECT_GT(outcome.out.size(), 50u) << command;
  }
}

TEST_F(Commands, AFailingRobotFailsAlone) {
  write(scratch / "p.c",
        "#include <kilolib.h>\nvoid setup(void) {}\nvoid loop(void) { if (kilo_uid == 7 && kilo_ticks > 30) "
        "*(volatile int *)0 = 1; }\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  EXPECT_EQ(run(small({"--behaviour", scratch / "p.c"}), scratch, "run").robots_failed, 1u);
}

}  // namespace
}  // namespace kilotwin::test
