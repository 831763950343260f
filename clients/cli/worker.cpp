#include "clients/cli/worker.hpp"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

/// Blocks SIGINT, SIGTERM and SIGCHLD while the object exists; next() waits for one of them.
class HeldSignals {
 public:
  HeldSignals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&signals_, signal);
    sigprocmask(SIG_BLOCK, &signals_, &before_);
  }
  ~HeldSignals() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  [[nodiscard]] int next() const { return sigwaitinfo(&signals_, nullptr); }

 private:
  sigset_t signals_{}, before_{};
};

}  // namespace

std::optional<os::ProcessEnd> end_of_worker() {
  std::fflush(nullptr);
  const HeldSignals held;
  const pid_t parent = getpid();
  const pid_t worker = fork();
  if (worker < 0) throw RunError("the run cannot be started: the system has no room for another process");
  if (worker == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    return std::nullopt;
  }
  bool forwarded = false;
  for (int status = 0;;) {
    if (waitpid(worker, &status, WNOHANG) == worker) {
      return WIFSIGNALED(status) ? os::ProcessEnd{0, WTERMSIG(status)} : os::ProcessEnd{WEXITSTATUS(status), 0};
    }
    const int signal = held.next();
    if (signal != SIGINT && signal != SIGTERM) continue;
    // The terminal sends SIGINT to both processes, and a second SIGINT would end the worker at once. So send SIGTERM first.
    kill(worker, forwarded && signal == SIGINT ? SIGKILL : SIGTERM);
    forwarded = true;
  }
}

}  // namespace kilotwin::cli
