#include "clients/recorder/run_directory.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <set>
#include <thread>

#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::recorder {
namespace {

namespace fs = std::filesystem;

TEST(RunDirectory, NamesItsFiles) {
  const Scratch scratch;
  const RunDirectory run = RunDirectory::create(scratch / "a/b/run");
  EXPECT_EQ(run.path(), scratch / "a/b/run");
  EXPECT_TRUE(fs::is_directory(run.programs()));
  EXPECT_EQ(run.manifest(), run.path() / "manifest.pb");
  EXPECT_EQ(run.experiment(), run.path() / "experiment.txtpb");
  Program program{"../walk.hex", "00ff", false};
  EXPECT_EQ(run.program(program), run.path() / "programs/00ff.so");
  program.firmware = true;
  EXPECT_EQ(run.program(program), run.path() / "programs/00ff.hex");
  EXPECT_EQ(run.recording(), run.path() / "recording.ktrec");
  EXPECT_EQ(run.summary(), run.path() / "summary.json");
  EXPECT_EQ(run.picture(), run.path() / "picture.svg");
  EXPECT_EQ(RunDirectory::default_path("disperse", 3), "runs/disperse-3");
}

TEST(RunDirectory, NeverUsesAnExistingRun) {
  const Scratch scratch;
  EXPECT_EQ(RunDirectory::create(scratch / "run").path(), scratch / "run");
  EXPECT_EQ(RunDirectory::create(scratch / "run/").path(), scratch / "run-2");
  fs::create_directory(scratch / "run-3");  // empty, so it may be used
  put_content(scratch / "run-4", "a file");
  EXPECT_EQ(RunDirectory::create(scratch / "run").path(), scratch / "run-3");
  EXPECT_EQ(RunDirectory::create(scratch / "run").path(), scratch / "run-5");
  EXPECT_EQ(content(scratch / "run-4"), "a file");
}

TEST(RunDirectory, RefusesAnExistingDirectoryThatIsNotEmpty) {
  const Scratch scratch;
  using Existing = RunDirectory::Existing;
  fs::create_directory(scratch / "run");  // empty, so it may be used
  EXPECT_EQ(RunDirectory::create(scratch / "run", Existing::kRefuse).path(), scratch / "run");
  EXPECT_THROW((void)RunDirectory::create(scratch / "run", Existing::kRefuse), UserError);
  EXPECT_FALSE(fs::exists(scratch / "run-2"));
}

TEST(RunDirectory, ReplacesOnlyDirectoriesOfKilotwin) {
  const Scratch scratch;
  using Existing = RunDirectory::Existing;
  put_content(RunDirectory::create(scratch / "run").path() / "summary.json", "old");
  EXPECT_EQ(RunDirectory::create(scratch / "run", Existing::kReplace).path(), scratch / "run");
  EXPECT_FALSE(fs::exists(scratch / "run/summary.json"));
  static_cast<void>(RunDirectory::create(scratch / "sweep/0000-1"));
  EXPECT_EQ(RunDirectory::create(scratch / "sweep", Existing::kReplace).path(), scratch / "sweep");
  EXPECT_FALSE(fs::exists(scratch / "sweep/0000-1"));
  fs::create_directory(scratch / "papers");
  put_content(scratch / "papers/thesis.tex", "years of work");
  EXPECT_THROW((void)RunDirectory::create(scratch / "papers", Existing::kReplace), UserError);
  EXPECT_EQ(content(scratch / "papers/thesis.tex"), "years of work");
}

TEST(RunDirectory, RefusesAFileAndAFolderThatCannotBeMade) {
  const Scratch scratch;
  put_content(scratch / "file", "x");
  EXPECT_THROW((void)RunDirectory::create(scratch / "file"), UserError);
  EXPECT_THROW((void)RunDirectory::create(scratch / "file/run"), RunError);
  EXPECT_THROW((void)RunDirectory::create(""), UserError);
  EXPECT_THROW((void)RunDirectory::create("/proc/run"), RunError);
}

TEST(RunDirectory, ThreadsThatStartTogetherGetDifferentOnes) {
  const Scratch scratch;
  for (int round = 0; round < 50; ++round) {
    const fs::path wanted = scratch / ("round" + std::to_string(round));
    if (round % 2 == 0) fs::create_directory(wanted);
    std::vector<fs::path> got(4);
    std::vector<std::thread> threads;
    for (fs::path& mine : got)
      threads.emplace_back([&mine, &wanted] { mine = RunDirectory::create(wanted).path(); });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(std::set<fs::path>(got.begin(), got.end()).size(), got.size());
    EXPECT_TRUE(fs::exists(wanted / "programs"));
  }
}

TEST(RunDirectory, ProcessesThatStartTogetherGetDifferentOnes) {
  const Scratch scratch;
  constexpr int kProcesses = 4, kEach = 20;
  std::vector<pid_t> children;
  for (int i = 0; i < kProcesses; ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (int k = 0; k < kEach; ++k) {
        // Each process leaves its mark; the mark of a second process in the same directory would fail.
        Writer(RunDirectory::create(scratch / "run").recording(), synthetic_header(1)).end(Tick{0}, 0);
      }
      ::_exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  int directories = 0;
  for (const auto& entry : fs::directory_iterator(scratch.path())) {
    EXPECT_TRUE(fs::exists(entry.path() / "recording.ktrec")) << entry.path();
    ++directories;
  }
  EXPECT_EQ(directories, kProcesses * kEach);
}

TEST(RunDirectory, OpensByDirectoryAndByRecording) {
  const Scratch scratch;
  const RunDirectory made = RunDirectory::create(scratch / "run");
  write_synthetic(made.recording(), synthetic_header(1), 3);
  EXPECT_EQ(RunDirectory::open(scratch / "run", RunDirectory::Needs::kRecording).recording(), made.recording());
  const RunDirectory by_file = RunDirectory::open(made.recording(), RunDirectory::Needs::kRecording);
  EXPECT_EQ(by_file.path(), made.path());
  EXPECT_EQ(by_file.recording(), made.recording());
  fs::rename(made.recording(), scratch / "run/kept.ktrec");
  EXPECT_EQ(RunDirectory::open(scratch / "run/kept.ktrec", RunDirectory::Needs::kRecording).recording(),
            scratch / "run/kept.ktrec");
}

TEST(RunDirectory, ErrorsNameTheExpectedFile) {
  const Scratch scratch;
  const auto error_of = [](const fs::path& run, RunDirectory::Needs needs) -> std::string {
    try {
      (void)RunDirectory::open(run, needs);
    } catch (const UserError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(error_of(scratch / "none", RunDirectory::Needs::kRecording),
            (scratch / "none").string() + ": does not exist; expected the directory of a run, as runs/NAME-SEED");
  EXPECT_EQ(error_of(scratch.path(), RunDirectory::Needs::kRecording),
            scratch.path().string() +
                ": not a run directory, it has no recording.ktrec; expected what `kilotwin run` wrote, as "
                "runs/NAME-SEED");
  EXPECT_NE(error_of(scratch.path(), RunDirectory::Needs::kManifest).find("it has no manifest.pb"),
            std::string::npos);
}

}  // namespace
}  // namespace kilotwin::recorder
