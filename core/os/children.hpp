/// Processes that this one starts and answers for: none outlives it, each has a time by which it must have ended, and each end
/// is known in words.
#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "core/os/descriptor.hpp"
#include "core/os/process.hpp"

namespace kilotwin::os {

/// "was killed by signal 9 (Killed)", "ended with status 3".
[[nodiscard]] std::string in_words(const ProcessEnd& end);
/// Whether its own code ended it (a wild access, abort()), not a signal from another process.
[[nodiscard]] bool crashed(const ProcessEnd& end);

/// This program, started again with other arguments.
struct ChildOptions {
  std::filesystem::path program = "/proc/self/exe";
  std::filesystem::path log;   ///< gets what it writes to stderr
  bool output_to_log = false;  ///< what it writes to stdout too; else that is dropped
  bool own_group = false;  ///< Ctrl-C of the terminal does not reach it, and signals reach all that it has started
  int at_death = SIGTERM;  ///< the signal that it gets when this process ends
  std::size_t tag = 0;     ///< for the starter's own use
};

class Child {
 public:
  /// `words`: its command line. Throws RunError that begins with `name`.
  Child(std::string name, std::vector<std::string> words, const ChildOptions& options);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t tag() const { return tag_; }
  [[nodiscard]] Process& process() { return process_; }
  /// The last line of its log that is not empty. Works also if the file has been removed.
  [[nodiscard]] std::string last_line() const;

 private:
  std::string name_;
  std::size_t tag_;
  Descriptor log_;
  Process process_;
};

/// When the object goes, the children that still run are ended.
class Children {
 public:
  using Clock = std::chrono::steady_clock;

  Children() = default;
  ~Children() { end(); }
  Children(const Children&) = delete;

  void start(std::string name, std::vector<std::string> words, const ChildOptions& options);
  [[nodiscard]] std::size_t running() const { return running_.size(); }
  /// To the children with this tag that run.
  void signal(std::size_t tag, int number);
  /// The children that have ended since the last call. Does not wait. Signals the others when their time is over.
  [[nodiscard]] std::list<Child> reap();
  /// Gives the children time until `when`: those that still run then get SIGTERM, and SIGKILL `patience` later. A later call
  /// can only shorten the time.
  void allow_until(Clock::time_point when, std::chrono::milliseconds patience = kPatience);
  /// Ends all that run and waits for them.
  void end();

  static constexpr std::chrono::milliseconds kPatience{1000};

 private:
  std::list<Child> running_;
  std::optional<Clock::time_point> ask_at_, kill_at_;
  bool asked_ = false;
};

}  // namespace kilotwin::os
