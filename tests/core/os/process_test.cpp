// Child processes: their output, how they end, and that none outlives its owner.
#include "core/os/process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"

namespace kilotwin::os {
namespace {

Command shell(const std::string& script) {
  Command command;
  command.arguments = {"/bin/sh", "-c", script};
  return command;
}

bool alive(pid_t process) { return kill(process, 0) == 0; }

/// Reads a pipe to its end, which comes only after all processes that hold its other end have ended.
std::string rest_of(int descriptor) {
  std::string text;
  char block[256];
  for (ssize_t n = read(descriptor, block, sizeof block); n > 0; n = read(descriptor, block, sizeof block))
    text.append(block, static_cast<std::size_t>(n));
  return text;
}

TEST(Process, ReturnsOutputAndStatus) {
  const ProcessResult result = run_process({"/bin/sh", "-c", "echo out; echo err >&2; cat; exit 3"});
  EXPECT_EQ(result.output, "out\n");
  EXPECT_EQ(result.errors, "err\n");
  EXPECT_EQ(result.end.code, 3);
  EXPECT_EQ(result.end.signal, 0);
}

TEST(Process, DistinguishesASignalFromAnExitStatus) {
  const ProcessResult result = run_process({"/bin/sh", "-c", "kill -9 $$"});
  EXPECT_EQ(result.end.signal, SIGKILL);
  EXPECT_FALSE(result.end.well());
  EXPECT_EQ(signal_name(result.end.signal), "signal 9 (Killed)");
  EXPECT_EQ(run_process({"/bin/sh", "-c", "exit 137"}).end.signal, 0);
}

TEST(Process, ReportsWhyAProgramCannotBeStarted) {
  try {
    (void)run_process({"/nowhere/at-all"});
    FAIL() << "it was started";
  } catch (const RunError& error) {
    EXPECT_STREQ(error.what(), "cannot start /nowhere/at-all: No such file or directory");
  }
}

TEST(Process, EndsWithItsOwner) {
  pid_t id = 0;
  {
    Process process(shell("exec sleep 1000"));
    id = process.id();
    EXPECT_FALSE(process.poll().has_value());
    EXPECT_TRUE(alive(id));
  }
  EXPECT_FALSE(alive(id));
}

TEST(Process, SignalsReachItsWholeGroup) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  Descriptor from(ends[0]), to(ends[1]);
  Command command = shell("sleep 1000 & echo ready; wait");
  command.output = to.get();
  command.own_group = true;
  Process process(command);
  to.reset();
  char first = 0;
  ASSERT_EQ(read(from.get(), &first, 1), 1);
  process.signal(SIGKILL);
  EXPECT_EQ(process.wait().signal, SIGKILL);
  EXPECT_EQ(rest_of(from.get()), "eady\n") << "its own child held the pipe open, and has ended too";
}

TEST(Process, DiesWithTheProcessThatStartedIt) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  Descriptor from(ends[0]), to(ends[1]);
  const pid_t owner = fork();
  ASSERT_GE(owner, 0);
  if (owner == 0) {
    Command command = shell("echo ready; exec sleep 1000");
    command.output = to.get();
    command.at_death = SIGKILL;
    const Process process(command);
    to.reset();
    pause();
  }
  to.reset();
  char first = 0;
  ASSERT_EQ(read(from.get(), &first, 1), 1);
  kill(owner, SIGKILL);
  waitpid(owner, nullptr, 0);
  EXPECT_EQ(rest_of(from.get()), "eady\n") << "whoever held the pipe has ended";
}

TEST(Process, StartsWithSignalsUnblocked) {
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
  const ProcessResult result = run_process({"/bin/sh", "-c", "kill -TERM $$; echo survived"});
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(result.output, "");
  EXPECT_EQ(result.end.signal, SIGTERM);
}

}  // namespace
}  // namespace kilotwin::os
