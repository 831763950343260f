/// Settings of a run besides those of engines: programs, EEPROMs, failures in earlier attempts, recording.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.hpp"

namespace kilotwin {

/// The program index of tracked groups, which have none.
inline constexpr std::uint32_t kNoProgram = 0xffffffffu;

struct Program {
  std::string path;       ///< as the experiment states it; the first source if there are several
  std::string sha256;     ///< SHA-256 of the executable file, hexadecimal
  bool firmware = false;  ///< compiled for the robot's processor

  /// The file's name in programs/ of the run directory: the SHA-256 with .so, .elf or .hex.
  [[nodiscard]] std::string file() const;
};

/// The initial content of a robot's EEPROM.
struct RobotEeprom {
  std::uint32_t robot = 0;
  std::string content;  ///< 1024 octets
};

/// A robot whose program crashed its host in an earlier attempt at this run. It fails in the step from `tick`.
struct ProgramFailure {
  std::uint32_t robot = 0;
  Tick tick;
};

struct RecordingSettings {
  double every_s = 0;     ///< interval of recorded states
  bool messages = false;  ///< count messages per pair of robots
};

/// Rate of loop(): RobotGroup.LoopRate in idl/experiment.proto.
enum class LoopRate : std::uint8_t { kOncePerTick, kAsOnRobot };

}  // namespace kilotwin
