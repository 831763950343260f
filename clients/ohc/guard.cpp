#include "clients/ohc/guard.hpp"

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin::ohc {

Guard::Guard(const std::function<void(int socket)>& work) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw RunError("no socket for the guard process: " + os::system_reason());
  os::Descriptor own(ends[0]), other(ends[1]);
  std::fflush(nullptr);
  process_ = fork();
  if (process_ < 0) throw RunError("the guard process cannot be started: " + os::system_reason());
  if (process_ == 0) {
    own.reset();
    setsid();
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) std::signal(signal, SIG_IGN);
    int status = 0;
    try {
      work(other.get());
    } catch (const std::exception& error) {
      say_error(error.what());
      status = 1;
    }
    std::fflush(nullptr);
    _exit(status);
  }
  socket_ = std::move(own);
}

Guard::~Guard() {
  socket_.reset();
  if (process_ > 0) waitpid(process_, nullptr, 0);
}

bool Guard::runs() {
  if (process_ > 0 && waitpid(process_, nullptr, WNOHANG) == process_) process_ = -1;
  return process_ > 0;
}

}  // namespace kilotwin::ohc
