/// Child processes that run beside this one. None outlives this process. allow_until() gives them a deadline. in_words()
/// describes how each one ended.
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
/// True if a signal that the process raised itself ended it (a wild access, abort()), false for a signal from another process.
[[nodiscard]] bool crashed(const ProcessEnd& end);

/// How to start a child. The default program is this one, started again with other arguments.
struct ChildOptions {
  std::filesystem::path program = "/proc/self/exe";
  std::filesystem::path log;   ///< file for its stderr
  bool output_to_log = false;  ///< true: its stdout goes to the log too; false: its stdout is discarded
  bool own_group = false;      ///< see Command::own_group
  int at_death = SIGTERM;      ///< the signal that it gets when this process ends
  std::size_t tag = 0;         ///< a number of the caller's choice, for Children::signal()
};

class Child {
 public:
  /// `words`: the command line, argv. Throws RunError, with `name` as its first word, if the start fails.
  Child(std::string name, std::vector<std::string> words, const ChildOptions& options);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t tag() const { return tag_; }
  [[nodiscard]] Process& process() { return process_; }
  /// The last non-empty line of its log, also if the file has been removed.
  [[nodiscard]] std::string last_line() const;

 private:
  std::string name_;
  std::size_t tag_;
  Descriptor log_;
  Process process_;
};

/// A set of children. The destructor ends those that still run.
class Children {
 public:
  using Clock = std::chrono::steady_clock;

  Children() = default;
  ~Children() { end(); }
  Children(const Children&) = delete;

  void start(std::string name, std::vector<std::string> words, const ChildOptions& options);
  [[nodiscard]] std::size_t running() const { return running_.size(); }
  /// Sends signal `number` to the running children with this tag.
  void signal(std::size_t tag, int number);
  /// Returns the children that ended since the last call. Does not wait. Signals the others if their deadline has passed.
  [[nodiscard]] std::list<Child> reap();
  /// Sets a deadline. Children that still run at `when` get SIGTERM, and `patience` later SIGKILL, sent by reap(). A further
  /// call can only bring the deadline forward.
  void allow_until(Clock::time_point when, std::chrono::milliseconds patience = kPatience);
  /// Ends all running children and waits for them.
  void end();

  static constexpr std::chrono::milliseconds kPatience{1000};

 private:
  std::list<Child> running_;
  std::optional<Clock::time_point> terminate_at_, kill_at_;
  bool terminated_ = false;
};

}  // namespace kilotwin::os
