// The robot whose program crashed its host, read by another process after the host's end.
#include "services/behaviours/running_note.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "services/behaviours/faults.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// A process that runs `swarm` until a signal ends it, with robot 1 busy nearly all the time. Returns once that robot runs.
pid_t run_in_a_process(Swarm& swarm) {
  int ready[2];
  EXPECT_EQ(pipe(ready), 0);
  const pid_t process = fork();
  if (process == 0) {
    alarm(60);
    RunningNote note(swarm.folder.path(), HostId{0});
    swarm.hosts[0]->note_running_in(note.place());
    swarm.start();
    const bool written = write(ready[1], "x", 1) == 1;
    for (; written;) swarm.step();
    _exit(1);
  }
  char octet = 0;
  EXPECT_EQ(read(ready[0], &octet, 1), 1);
  close(ready[0]);
  close(ready[1]);
  return process;
}

/// Robot 1 counts on and on, as long as a tick lasts.
const char* const kBusy =
    "static volatile uint32_t n; static void loop(void) { if (kilo_uid == 1) while (++n != 0) {} }";

TEST(RunningNote, ASignalFromAnotherProcessNamesNoRobot) {
  for (const int signal : {SIGABRT, SIGABRT, SIGSEGV, SIGBUS, SIGILL}) {
    Swarm swarm({program(kBusy)}, 2);
    const pid_t process = run_in_a_process(swarm);
    usleep(20'000);
    kill(process, signal);
    int status = 0;
    ASSERT_EQ(waitpid(process, &status, 0), process);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal) << status;
    EXPECT_FALSE(take_note(swarm.folder.path(), HostId{0}).has_value()) << "signal " << signal;
  }
}

TEST(RunningNote, NamesNoRobotThatAnotherThreadEntersAfterTheSignal) {
  const Folder folder;
  for (const bool sent : {false, true}) {
    RunningNote note(folder.path(), HostId{0});
    note.place().robot = 3;
    if (sent) before_sent_signal.load()();
    note.place().robot = 4;
    const auto culprit = take_note(folder.path(), HostId{0});
    ASSERT_EQ(culprit.has_value(), !sent);
    if (culprit) {
      EXPECT_EQ(culprit->robot, 4u);
    }
  }
}

TEST(RunningNote, NamesTheRobotWhoseProgramEndedTheProcess) {
  // It overwrites the address to which control returns in the host.
  Swarm swarm({program("static void loop(void) { if (kilo_uid == 1 && kilo_ticks == 5) { void** host; __asm__ "
                       "volatile(\"mov %%gs:0, %0\" : \"=r\"(host)); host[6] = 0; } }")},
              2);
  const pid_t process = run_in_a_process(swarm);
  int status = 0;
  ASSERT_EQ(waitpid(process, &status, 0), process);
  EXPECT_TRUE(WIFSIGNALED(status)) << status;
  const auto culprit = take_note(swarm.folder.path(), HostId{0});
  ASSERT_TRUE(culprit.has_value());
  EXPECT_EQ(culprit->robot, 1u);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
