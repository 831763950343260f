#include "services/behaviours/running_note.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <new>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/faults.hpp"

namespace kilotwin::behaviours {
namespace {

using Running = BehavioursEngine::Running;
static_assert(std::atomic<std::uint32_t>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free);

/// All notes of this process, for the signal handler.
std::array<std::atomic<Running*>, 64> noted{};

/// Clears all notes, because a signal from another process is not caused by a robot.
void clear_notes() {
  for (const auto& place : noted) {
    if (Running* const running = place.load()) running->robot.store(BehavioursEngine::kNobody);
  }
}

std::filesystem::path note_of(const std::filesystem::path& run_directory, HostId host) {
  return run_directory / ("running-" + std::to_string(host.value() + 1));
}

}  // namespace

RunningNote::RunningNote(const std::filesystem::path& run_directory, HostId host)
    : path_(note_of(run_directory, host)) {
  const int file = open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  void* mapped = MAP_FAILED;
  if (file >= 0 && ftruncate(file, sizeof(Running)) == 0)
    mapped = mmap(nullptr, sizeof(Running), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (file >= 0) close(file);
  if (mapped == MAP_FAILED) throw RunError(path_.string() + ": cannot be written; is the disk full?");
  place_ = new (mapped) Running;
  for (auto& free : noted) {
    Running* none = nullptr;
    if (free.compare_exchange_strong(none, place_)) break;
  }
  before_sent_signal = clear_notes;
}

RunningNote::~RunningNote() {
  for (auto& own : noted) {
    Running* here = place_;
    if (own.compare_exchange_strong(here, nullptr)) break;
  }
  munmap(static_cast<void*>(place_), sizeof(Running));
  unlink(path_.c_str());
}

std::optional<Culprit> take_note(const std::filesystem::path& run_directory, HostId host) {
  const std::filesystem::path path = note_of(run_directory, host);
  const auto octets = os::read_if_there(path);
  unlink(path.c_str());
  if (!octets || octets->size() != sizeof(Running)) return std::nullopt;
  Culprit culprit;
  std::int64_t tick = 0;
  std::memcpy(&culprit.robot, octets->data() + offsetof(Running, robot), sizeof culprit.robot);
  std::memcpy(&tick, octets->data() + offsetof(Running, tick), sizeof tick);
  culprit.tick = Tick{tick};
  if (culprit.robot == BehavioursEngine::kNobody) return std::nullopt;
  return culprit;
}

}  // namespace kilotwin::behaviours
