/// Runs the program for a test.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "clients/recorder/summary.hpp"

namespace kilotwin::test {

using Words = std::vector<std::string>;

struct Outcome {
  int status = -1;  ///< exit status, or 128 + signal
  std::string out, err;
};

/// A process that ends with the object.
class Process {
 public:
  /// Starts `words`; output goes to files in `scratch`.
  Process(const Words& words, const std::filesystem::path& scratch);
  ~Process();
  Process(const Process&) = delete;
  [[nodiscard]] pid_t id() const { return process_; }
  void signal(int number) const;
  /// Waits for its end. Kills it after `seconds`, a bound against hanging.
  Outcome wait(double seconds = 120);
  [[nodiscard]] bool running();
  /// Whether it writes `text` to stderr within `seconds`.
  [[nodiscard]] bool says(const std::string& text, double seconds) const;

 private:
  pid_t process_ = -1;
  std::filesystem::path out_, err_;
  bool ended_ = false;
  int wait_status_ = 0;
};

/// A temporary directory.
class Scratch {
 public:
  Scratch();
  ~Scratch();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Runs `kilotwin WORDS...` to its end.
Outcome kilotwin(const Words& words, const Scratch& scratch);
/// Path of the program.
std::string program();
/// A file of the repository.
std::string source(const std::string& name);
std::string read(const std::filesystem::path& file);
void write(const std::filesystem::path& file, const std::string& text);
/// Runs an experiment with --quiet and returns its summary. Fails the test unless the status is 0.
recorder::Summary run(Words words, const Scratch& scratch, const std::string& name);
/// Processes whose command line contains `text`.
std::vector<pid_t> processes_with(const std::string& text);
/// Polls until `condition` holds; false after `seconds`, a bound against hanging.
template <class Condition> bool eventually(Condition condition, double seconds = 90);

void sleep_briefly();
double now_s();

template <class Condition> bool eventually(Condition condition, double seconds) {
  for (const double end = now_s() + seconds; now_s() < end; sleep_briefly()) {
    if (condition()) return true;
  }
  return condition();
}

}  // namespace kilotwin::test
