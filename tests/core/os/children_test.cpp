// Child processes: none outlives this process, and a text describes each end.
#include "core/os/children.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "core/base/error.hpp"

namespace kilotwin::os {
namespace {

namespace fs = std::filesystem;

class ChildrenTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "kilotwin-children-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    scratch = pattern;
    options.program = "/bin/sh";
    options.log = scratch / "log";
  }
  void TearDown() override { fs::remove_all(scratch); }
  static std::vector<std::string> shell(const std::string& script) { return {"sh", "-c", script}; }
  /// Polls until `condition` holds, for at most 30 s.
  template <class Condition> static bool eventually(Condition condition) {
    for (int turn = 0; turn < 15000; ++turn) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  }
  static ProcessEnd end_of(Child& child) {
    EXPECT_TRUE(eventually([&] { return child.process().poll().has_value(); }));
    return child.process().poll().value_or(ProcessEnd{-1, 0});
  }
  /// Whether the process runs. A zombie, which nobody has waited for, does not.
  static bool runs(pid_t process) {
    const std::string status = text_of("/proc/" + std::to_string(process) + "/stat");
    return !status.empty() && status.find(") Z ") == std::string::npos;
  }
  static std::string text_of(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }
  fs::path scratch;
  ChildOptions options;
};

TEST_F(ChildrenTest, DescribesTheEndOfAProcess) {
  Child well("well", shell("exit 0"), options), third("third", shell("exit 3"), options),
      killed("killed", shell("kill -KILL $$"), options), crashed("crashed", shell("kill -SEGV $$"), options);
  EXPECT_TRUE(end_of(well).well());
  EXPECT_EQ(in_words(end_of(third)), "ended with status 3");
  EXPECT_EQ(in_words(end_of(killed)), "was killed by signal 9 (Killed)");
  EXPECT_FALSE(os::crashed(end_of(killed)));
  EXPECT_TRUE(os::crashed(end_of(crashed)));
}

TEST_F(ChildrenTest, ReadsTheLastLineOfARemovedLog) {
  Child child("child", shell("echo first >&2; echo last >&2; echo output"), options);
  end_of(child);
  fs::remove(options.log);
  EXPECT_EQ(child.last_line(), "last");
  options.output_to_log = true;
  Child both("both", shell("echo last >&2; echo output"), options);
  end_of(both);
  EXPECT_EQ(both.last_line(), "output");
}

TEST_F(ChildrenTest, TerminatesThenKillsAProcessAfterItsDeadline) {
  Children children;
  children.start("obedient", shell("echo ready >&2; exec sleep 600"), options);
  options.log = scratch / "other";
  options.own_group = true;  // its sleep is a separate process, which the group's signal ends too
  children.start("deaf", shell("trap '' TERM; echo ready >&2; while :; do sleep 600; done"), options);
  ASSERT_TRUE(
      eventually([&] { return text_of(scratch / "log") == "ready\n" && text_of(scratch / "other") == "ready\n"; }));
  EXPECT_TRUE(children.reap().empty());
  children.allow_until(Children::Clock::now(), std::chrono::milliseconds(50));
  std::vector<std::string> ends;
  EXPECT_TRUE(eventually([&] {
    for (Child& child : children.reap()) ends.push_back(child.name() + " " + in_words(*child.process().poll()));
    return children.running() == 0;
  }));
  EXPECT_EQ(ends, (std::vector<std::string>{"obedient was killed by signal 15 (Terminated)",
                                            "deaf was killed by signal 9 (Killed)"}));
}

TEST_F(ChildrenTest, ASignalReachesTheWholeGroup) {
  options.own_group = true;
  pid_t grandchild = -1;
  {
    Child child("child", shell("sleep 600 & echo $! >&2; wait"), options);
    ASSERT_TRUE(eventually([&] { return text_of(options.log).ends_with('\n'); }));
    grandchild = std::stoi(text_of(options.log));
    EXPECT_TRUE(runs(grandchild));
  }
  EXPECT_TRUE(eventually([&] { return !runs(grandchild); }));
}

TEST_F(ChildrenTest, NoneOutlivesItsParent) {
  const pid_t parent = fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    Child child("child", shell("echo $$ >&2; exec sleep 600"), options);
    pause();
    _exit(0);
  }
  const bool started = eventually([&] { return text_of(options.log).ends_with('\n'); });
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  ASSERT_TRUE(started);
  const pid_t grandchild = std::stoi(text_of(options.log));
  EXPECT_TRUE(eventually([&] { return !runs(grandchild); }));
}

TEST_F(ChildrenTest, NamesAProgramThatDoesNotExist) {
  options.program = scratch / "none";
  try {
    Child child("radio", {"none"}, options);
    FAIL() << "started";
  } catch (const RunError& error) {
    EXPECT_NE(std::string(error.what()).find("radio: cannot start "), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kilotwin::os
