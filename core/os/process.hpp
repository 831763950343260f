/// Child processes: start them, watch them, end them. No shell is involved.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::os {

/// How a process ended.
struct ProcessEnd {
  int code = 0;    ///< exit status; meaningless if `signal` is not 0
  int signal = 0;  ///< the signal that ended it; 0: it ended by itself
  [[nodiscard]] bool well() const { return code == 0 && signal == 0; }
};
/// "signal 9 (Killed)".
[[nodiscard]] std::string signal_name(int signal);

/// A program to start, with its surroundings.
struct Command {
  static constexpr int kDiscard = -1;  ///< /dev/null
  static constexpr int kInherit = -2;  ///< the descriptor of this process
  enum class Environment {
    kInherit,
    /// The C locale, and none of the variables that redirect compilers (CPATH, GCC_EXEC_PREFIX...).
    kPlain
  };

  std::vector<std::string> arguments;  ///< argv; arguments[0] is also the program's path unless `program` is given
  std::filesystem::path program;       ///< empty: arguments[0]
  int input = kDiscard;                ///< descriptor of its standard input; kDiscard: empty
  int output = kInherit, errors = kInherit;  ///< descriptors for its standard output and error
  Environment environment = Environment::kInherit;
  /// Starts a process group. The terminal's Ctrl-C does not reach the group, and signal() reaches its descendants too.
  bool own_group = false;
  /// The signal that the child gets when the thread that started it ends for any reason (PR_SET_PDEATHSIG); 0: none.
  int at_death = 0;
};

/// A child process. Signals are sent only before it has been waited for, so never to an unrelated process with a reused id.
class Process {
 public:
  /// Starts it. Throws RunError if the program does not exist or the system lacks memory or process ids.
  explicit Process(const Command&);
  Process(Process&&) noexcept;
  Process& operator=(Process&&) = delete;
  /// Kills the child if it still runs.
  ~Process();

  [[nodiscard]] pid_t id() const { return id_; }
  /// How the child ended, or nothing while it runs. Does not wait.
  [[nodiscard]] const std::optional<ProcessEnd>& poll();
  ProcessEnd wait();
  /// Sends a signal to the child, or to its group if it has one. Does nothing after poll() or wait() has reported the end.
  void signal(int number) const;

 private:
  bool collect(int flags);

  pid_t id_ = -1;
  bool own_group_ = false;
  std::optional<ProcessEnd> end_;
};

struct ProcessResult {
  ProcessEnd end;
  std::string output;  ///< its standard output
  std::string errors;  ///< its standard error
};
/// Runs arguments[0], a path, to its end in Environment::kPlain. Throws RunError if it cannot be started.
[[nodiscard]] ProcessResult run_process(const std::vector<std::string>& arguments);

/// The path of the first executable of this name in the directories of $PATH; empty if there is none.
[[nodiscard]] std::filesystem::path find_executable(std::string_view name);

}  // namespace kilotwin::os
