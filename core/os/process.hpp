/// Other programs: started, watched, ended. No shell is involved.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::os {

/// How a process has ended.
struct ProcessEnd {
  int code = 0;    ///< exit status; meaningless where `signal` is not 0
  int signal = 0;  ///< that ended it; 0: it ended by itself
  [[nodiscard]] bool well() const { return code == 0 && signal == 0; }
};
/// "signal 9 (Killed)".
[[nodiscard]] std::string signal_name(int signal);

/// A program to be started.
struct Command {
  static constexpr int kNowhere = -1, kOwn = -2;  ///< /dev/null; that of this process
  enum class Environment {
    kOwn,
    /// The C locale, and none of the variables that redirect compilers (CPATH, GCC_EXEC_PREFIX...).
    kPlain
  };

  std::vector<std::string> arguments;  ///< [0]: the program's path; what it is called, if `program` is given
  std::filesystem::path program;       ///< empty: arguments[0]
  int output = kOwn, errors = kOwn;  ///< descriptors that it gets as standard output and errors. Its input is empty
  Environment environment = Environment::kOwn;
  /// A process group of its own: the terminal's Ctrl-C does not reach it, and signals reach what it starts as well.
  bool own_group = false;
  int at_death = 0;  ///< signal that it gets when the thread that started it ends, however that ends; 0: none
};

/// A child process. Signals are sent only while it has not been waited for, so never to a stranger of the same number.
class Process {
 public:
  /// Throws RunError where it cannot be started, for lack of the program or of room.
  explicit Process(const Command&);
  Process(Process&&) noexcept;
  Process& operator=(Process&&) = delete;
  /// Kills it if it still runs.
  ~Process();

  [[nodiscard]] pid_t id() const { return id_; }
  /// Its end, if it has ended. Does not wait.
  [[nodiscard]] const std::optional<ProcessEnd>& poll();
  ProcessEnd wait();
  /// To it, or to its group if it has its own; nothing once its end is known.
  void signal(int number) const;

 private:
  bool collect(int flags);

  pid_t id_ = -1;
  bool own_group_ = false;
  std::optional<ProcessEnd> end_;
};

struct ProcessResult {
  ProcessEnd end;
  std::string output;  ///< what it wrote to standard output
  std::string errors;  ///< what it wrote to standard error
};
/// Runs arguments[0], a path, to its end in the plain environment. Throws RunError where it cannot be started.
[[nodiscard]] ProcessResult run_process(const std::vector<std::string>& arguments);

/// The first directory of $PATH that holds an executable of this name; empty where none does.
[[nodiscard]] std::filesystem::path find_executable(std::string_view name);

}  // namespace kilotwin::os
