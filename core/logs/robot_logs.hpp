/// What robots print, in files of their own: logs/robot-00017.txt of the run directory. Each line begins with the time at which it
/// was begun, s.
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
  static constexpr std::uint64_t kMostOctets = 1 << 20;  ///< of one file; a last line says that it ends there

  /// A run that starts at tick `first`, from a checkpoint or from its beginning, loses what earlier attempts have printed from
  /// there on: by robots that are `own`, which no other process writes for. No file is made before a robot prints.
  RobotLogs(const std::filesystem::path& run_directory, const TickLength& tick_length, Tick first,
            const std::function<bool(std::uint32_t robot)>& own);
  RobotLogs(const RobotLogs&) = delete;
  RobotLogs& operator=(const RobotLogs&) = delete;
  /// Writes what is left. An error is said, as there is nobody to tell.
  ~RobotLogs();

  /// Of a robot in the step from `from`. Written at once where much is waiting, else after a second or with the object's end.
  /// Throws RunError where a file cannot be written.
  void write(Tick from, std::uint32_t robot, std::string_view text);
  void flush();

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
