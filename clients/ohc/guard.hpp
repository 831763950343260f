/// A small process of this program that outlives it, however it ends, and leaves things in order.
#pragma once

#include <sys/types.h>

#include <functional>

#include "core/os/descriptor.hpp"

namespace kilotwin::ohc {

class Guard {
 public:
  /// Forks; to be called before the process has threads. `work` runs in the new process, which no signal of the terminal
  /// reaches. It gets one end of a socket that keeps messages apart; end of file there means that this process has ended.
  /// The new process ends when `work` returns. Throws RunError where there is no room for it.
  explicit Guard(const std::function<void(int socket)>& work);
  /// Closes the socket and waits for the process's end.
  ~Guard();
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;

  [[nodiscard]] int socket() const { return socket_.get(); }
  /// False once the process has ended before its time.
  [[nodiscard]] bool runs();

 private:
  os::Descriptor socket_;
  pid_t process_ = -1;
};

}  // namespace kilotwin::ohc
