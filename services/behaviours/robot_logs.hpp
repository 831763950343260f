/// What robots print, in files of their own: logs/robot-N.txt of the run directory, each line after the time on which it was
/// begun, s.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "services/behaviours/engine.hpp"
#include "core/base/time.hpp"

namespace kilotwin::behaviours {

class RobotLogs {
 public:
  static constexpr std::uint64_t kMostOctets = 1 << 20;  ///< of one file; a last line says that it ends there

  /// Nothing is written before a robot prints. A run that goes on from a checkpoint of tick `first` loses what its robots of
  /// `share` have printed since.
  RobotLogs(const std::filesystem::path& run_directory, const TickLength& tick_length, Tick first,
            const Share& share);
  RobotLogs(const RobotLogs&) = delete;
  RobotLogs& operator=(const RobotLogs&) = delete;
  ~RobotLogs();

  /// What was printed in the step from `from` on. Throws RunError where files cannot be written.
  void write(Tick from, const std::vector<BehavioursEngine::Printed>& printed);
  void flush();

 private:
  struct Log {
    std::string text;  ///< not yet in the file
    std::uint64_t octets = 0;
    bool at_line_start = true;
  };
  [[nodiscard]] std::filesystem::path file_of(std::uint32_t robot) const;
  void append(double time_s, const std::string& text, Log& log) const;
  void cut(Tick first, const Share& share);

  std::filesystem::path folder_;
  TickLength tick_length_;
  std::map<std::uint32_t, Log> logs_;
};

}  // namespace kilotwin::behaviours
