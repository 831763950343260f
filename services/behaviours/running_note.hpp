/// A file in the run directory with the robot whose program a host is running. After a crash of the host it identifies the cause.
/// If another process sends a signal that ends the host, the file says so, and no robot is the cause.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

struct Note;

/// The host maps the file and writes to it while this object exists. The destructor removes the file.
class RunningNote {
 public:
  /// Creates and maps the file. Throws RunError if that fails.
  RunningNote(const std::filesystem::path& run_directory, HostId host);
  ~RunningNote();
  RunningNote(const RunningNote&) = delete;
  [[nodiscard]] BehavioursEngine::Running& place();

 private:
  std::filesystem::path path_;
  Note* note_ = nullptr;
};

struct Culprit {
  std::uint32_t robot = 0;
  Tick tick;  ///< tick from which the host was stepping
};
/// The robot whose program was running when the host ended. Nothing if the host was between programs, or a signal from another
/// process ended it. Removes the file.
[[nodiscard]] std::optional<Culprit> take_note(const std::filesystem::path& run_directory, HostId host);

}  // namespace kilotwin::behaviours
