// Where commands write: --out, --force, and what happens to results that exist.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class Output : public testing::Test {
 protected:
  /// A short local run with these words.
  Outcome brief_run(const Words& more) const {
    Words words{"run", source("experiments/disperse.txtpb"), "--duration", "1", "--robots", "4", "--mode", "local"};
    words.insert(words.end(), more.begin(), more.end());
    return kilotwin(words, scratch);
  }
  /// Expects one line that names `place`, status 2, and nothing beside it.
  static void expect_refused(const Outcome& outcome, const std::string& place) {
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(place), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("--force"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(place + "-2"));
  }
  Scratch scratch;
};

TEST_F(Output, ThatExistsIsRefused) {
  const std::string here = scratch / "here";
  ASSERT_EQ(brief_run({"--out", here}).status, 0);
  const std::string before = read(here + "/recording.ktrec");
  expect_refused(brief_run({"--out", here, "--seed", "2"}), here);
  expect_refused(brief_run({"--out", here, "--prepare"}), here);
  EXPECT_EQ(read(here + "/recording.ktrec"), before);
  expect_refused(kilotwin({"sweep", source("experiments/disperse.txtpb"), "--out", here}, scratch), here);
}

TEST_F(Output, ThatIsEmptyIsTaken) {
  fs::create_directory(scratch / "here");
  EXPECT_EQ(brief_run({"--out", scratch / "here"}).status, 0);
  EXPECT_TRUE(fs::exists(scratch / "here/summary.json"));
}

TEST_F(Output, IsReplacedByForce) {
  const std::string here = scratch / "here";
  ASSERT_EQ(brief_run({"--out", here}).status, 0);
  write(here + "/left.txt", "of the first run");
  ASSERT_EQ(brief_run({"--out", here, "--force", "--seed", "2"}).status, 0);
  EXPECT_EQ(recorder::read_summary(here + "/summary.json").seed, 2u);
  EXPECT_FALSE(fs::exists(here + "/left.txt"));
  const Words sweep{
      "sweep",          source("experiments/disperse.txtpb"), "--duration", "1", "--robots", "4", "--out",
      scratch / "sweep"};
  ASSERT_EQ(kilotwin(sweep, scratch).status, 0);
  expect_refused(kilotwin(sweep, scratch), scratch / "sweep");
  Words forced = sweep;
  forced.push_back("--force");
  EXPECT_EQ(kilotwin(forced, scratch).status, 0);
}

TEST_F(Output, IsNotReplacedWhereItHoldsOtherFilesOrTheInput) {
  fs::create_directory(scratch / "papers");
  write(scratch / "papers/thesis.tex", "years of work");
  EXPECT_EQ(brief_run({"--out", scratch / "papers", "--force"}).status, 2);
  EXPECT_EQ(read(scratch / "papers/thesis.tex"), "years of work");
  ASSERT_EQ(brief_run({"--out", scratch / "run", "--checkpoint-every", "0.3"}).status, 0);
  const Outcome resumed =
      kilotwin({"run", source("experiments/disperse.txtpb"), "--duration", "2", "--robots", "4", "--mode", "local",
                "--resume", scratch / "run", "--out", scratch / "run", "--force"},
               scratch);
  EXPECT_EQ(resumed.status, 2) << resumed.err;
  EXPECT_NE(resumed.err.find("which this command reads"), std::string::npos) << resumed.err;
  EXPECT_TRUE(fs::exists(scratch / "run/checkpoints"));
}

TEST_F(Output, OfASecondRunWithoutANameIsSaidOnTheLastLine) {
  ASSERT_EQ(brief_run({}).status, 0);
  const std::string before = read(scratch / "runs/disperse-1/summary.json");
  const Outcome second = brief_run({});
  ASSERT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(read(scratch / "runs/disperse-1/summary.json"), before);
  EXPECT_TRUE(fs::exists(scratch / "runs/disperse-1-2/summary.json"));
  const std::string last = second.out.substr(second.out.rfind('\n', second.out.size() - 2) + 1);
  EXPECT_NE(last.find("runs/disperse-1-2"), std::string::npos) << second.out;
  EXPECT_NE(last.find("runs/disperse-1 holds an earlier result"), std::string::npos) << second.out;
}

TEST_F(Output, ProgramsOfOneNameFromDifferentFoldersAreBothKept) {
  for (const std::string folder : {"a", "b"}) {
    fs::create_directory(scratch / folder);
    write(scratch / (folder + "/walk.c"),
          "#include <kilolib.h>\nvoid setup(void) { set_color(" + std::string(folder == "a" ? "1" : "2") +
              "); }\nvoid loop(void) {}\n"
              "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  }
  write(scratch / "e.txtpb",
        "duration_s: 1\nrobots { count: 2 behaviour: \"a/walk.c\" layout { grid {} x_mm: -100 } }\n"
        "robots { count: 2 behaviour: \"b/walk.c\" layout { grid {} x_mm: 100 } }\n");
  run({scratch / "e.txtpb", "--mode", "local"}, scratch, "run");
  std::vector<std::string> kept;
  for (const auto& entry : fs::directory_iterator(scratch / "run/programs")) {
    if (entry.path().extension() == ".c") kept.push_back(read(entry.path()));
  }
  std::sort(kept.begin(), kept.end());
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0], read(scratch / "a/walk.c"));
  EXPECT_EQ(kept[1], read(scratch / "b/walk.c"));
}

TEST_F(Output, PluginsOfOneNameFromDifferentFoldersAreBothKept) {
  for (const std::string folder : {"a", "b"}) {
    fs::create_directory(scratch / folder);
    write(scratch / (folder + "/empty.cpp"),
          "#include <kilotwin_station.hpp>\nstruct Empty : KilobotExperiment {  // " + folder +
              "\n  void initialise(bool) override {}\n  void serialize(Archive&) override {}\n};\n"
              "extern \"C\" KilobotExperiment* createExpt() { return new Empty; }\n");
  }
  write(scratch / "e.txtpb",
        "duration_s: 1\nrobots { count: 1 behaviour: \"idle.c\" layout { grid {} } }\nstation {\n"
        "  environment { plugin { source: \"a/empty.cpp\" } }\n  environment { plugin { source: \"b/empty.cpp\" } "
        "}\n}\n");
  write(scratch / "idle.c",
        "#include <kilolib.h>\nvoid setup(void) {}\nvoid loop(void) {}\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  run({scratch / "e.txtpb", "--mode", "local"}, scratch, "run");
  std::set<std::string> kept;
  for (const auto& entry : fs::directory_iterator(scratch / "run/plugins")) {
    if (entry.path().extension() == ".cpp") kept.insert(read(entry.path()));
  }
  EXPECT_EQ(kept, (std::set<std::string>{read(scratch / "a/empty.cpp"), read(scratch / "b/empty.cpp")}));
}

TEST_F(Output, MoreThreadsThanCoresAreWarnedOf) {
  const Outcome outcome = brief_run({"--threads", "200", "--quiet"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.err.find("--threads 200: this process may use"), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

}  // namespace
}  // namespace kilotwin::test
