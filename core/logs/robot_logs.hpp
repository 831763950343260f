/// Log files of what robots print, one per robot: logs/robot-00017.txt in the run directory. Each line begins with the time, s, at
/// which the robot began to print it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "core/base/time.hpp"

namespace kilotwin {

class RobotLogs {
 public:
  /// Limit per file. A log that reaches it ends with a line that says so.
  static constexpr std::uint64_t kMostOctets = 1 << 20;

  /// Prepares the logs of an attempt that starts at tick `first`, which is 0 or a checkpoint's tick. Removes the lines that
  /// earlier attempts wrote at `first` or later. Touches only the files of robots for which own(robot) is true, because other
  /// processes write the others. A robot gets a file when it first prints. Throws RunError if a file cannot be shortened.
  RobotLogs(const std::filesystem::path& run_directory, const TickLength& tick_length, Tick first,
            const std::function<bool(std::uint32_t robot)>& own);
  RobotLogs(const RobotLogs&) = delete;
  RobotLogs& operator=(const RobotLogs&) = delete;
  /// Writes the text that waits, for runs that an exception ends. Prints an error to stderr, because a destructor cannot throw.
  ~RobotLogs();

  /// Adds text that the robot printed in the step from tick `from`. The text reaches the file after at most one second of
  /// simulated time, earlier if 4 KiB wait. Throws RunError if a file cannot be written.
  void write(Tick from, std::uint32_t robot, std::string_view text);
  /// Writes the text that waits. To be called at each checkpoint and at the end of the run. Opens and closes each file that has
  /// text: a run may have more robots than a process may have open files. Throws RunError if a file cannot be written.
  void flush();

  /// A robot's file in a run directory.
  [[nodiscard]] static std::filesystem::path file_in(const std::filesystem::path& run_directory,
                                                     std::uint32_t robot);

 private:
  struct Log {
    std::string text;  ///< not yet in the file
    std::uint64_t octets = 0;
    bool at_line_start = true;
  };
  [[nodiscard]] std::filesystem::path file_of(std::uint32_t robot) const;
  void cut(Tick first, const std::function<bool(std::uint32_t)>& own);

  std::filesystem::path folder_;
  TickLength tick_length_;
  std::map<std::uint32_t, Log> logs_;
  std::size_t waiting_ = 0;  ///< octets
  Tick waiting_since_;
};

}  // namespace kilotwin
