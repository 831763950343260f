/// Whose program a host runs, in a file of the run directory: it tells who has brought down the host.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// The file, mapped and written by the host of this number while the object exists. A host that ends in order removes it.
class RunningNote {
 public:
  /// Throws RunError where the file cannot be made.
  RunningNote(const std::filesystem::path& run_directory, HostId host);
  ~RunningNote();
  RunningNote(const RunningNote&) = delete;
  [[nodiscard]] BehavioursEngine::Running& place() { return *place_; }

 private:
  std::filesystem::path path_;
  BehavioursEngine::Running* place_ = nullptr;
};

struct Culprit {
  std::uint32_t robot = 0;
  Tick tick;  ///< of the step in which its program was running
};
/// Whose program was running when a host ended; nobody where it was between programs, or was ended by a signal that another
/// process had sent. Removes the note.
[[nodiscard]] std::optional<Culprit> take_note(const std::filesystem::path& run_directory, HostId host);

}  // namespace kilotwin::behaviours
