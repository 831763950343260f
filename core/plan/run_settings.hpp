/// What a run takes along besides the settings of engines: programs, EEPROMs, earlier failures; how it is recorded.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.hpp"

namespace kilotwin {

/// In place of a program: the group is tracked.
inline constexpr std::uint32_t kNoProgram = 0xffffffffu;

struct Program {
  std::string path;       ///< as the experiment names it; the first source where it has several
  std::string sha256;     ///< of what runs, hex
  bool firmware = false;  ///< for the robot's own processor

  /// The name of its file in the run directory's programs/: SHA256 and .so, .elf or .hex.
  [[nodiscard]] std::string file() const;
};

/// The content that a robot's EEPROM starts with.
struct RobotEeprom {
  std::uint32_t robot = 0;
  std::string content;  ///< 1024 octets
};

/// A robot whose program brought down its host in an earlier attempt at this run. It fails in the step from `tick`.
struct ProgramFailure {
  std::uint32_t robot = 0;
  Tick tick;
};

struct RecordingSettings {
  double every_s = 0;     ///< between recorded states
  bool messages = false;  ///< whether messages are counted per pair of robots
};

/// How often loop() runs: RobotGroup.LoopRate in idl/experiment.proto.
enum class LoopRate : std::uint8_t { kOncePerTick, kAsOnRobot };

}  // namespace kilotwin
