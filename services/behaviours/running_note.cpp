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

/// The content of the file.
struct Note {
  BehavioursEngine::Running running;
  std::atomic<std::uint32_t> signal_was_sent{0};  ///< 1 from the first signal of another process on
};

namespace {

static_assert(std::atomic<std::uint32_t>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free);

/// All notes of this process, for the signal handler.
std::array<std::atomic<Note*>, 64> noted{};

/// Marks all notes. Other threads may still enter further robots before the process ends, so the robots' fields would not do.
void mark_notes() {
  for (const auto& place : noted) {
    if (Note* const note = place.load()) note->signal_was_sent.store(1);
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
  if (file >= 0 && ftruncate(file, sizeof(Note)) == 0)
    mapped = mmap(nullptr, sizeof(Note), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (file >= 0) close(file);
  if (mapped == MAP_FAILED) throw RunError(path_.string() + ": cannot be written; is the disk full?");
  note_ = new (mapped) Note;
  for (auto& free : noted) {
    Note* none = nullptr;
    if (free.compare_exchange_strong(none, note_)) break;
  }
  before_sent_signal = mark_notes;
}

RunningNote::~RunningNote() {
  for (auto& own : noted) {
    Note* here = note_;
    if (own.compare_exchange_strong(here, nullptr)) break;
  }
  munmap(static_cast<void*>(note_), sizeof(Note));
  unlink(path_.c_str());
}

BehavioursEngine::Running& RunningNote::place() { return note_->running; }

std::optional<Culprit> take_note(const std::filesystem::path& run_directory, HostId host) {
  const std::filesystem::path path = note_of(run_directory, host);
  const auto octets = os::read_if_there(path);
  unlink(path.c_str());
  if (!octets || octets->size() != sizeof(Note)) return std::nullopt;
  const auto copy = [&](auto& to, std::size_t offset) { std::memcpy(&to, octets->data() + offset, sizeof to); };
  Culprit culprit;
  std::int64_t tick = 0;
  std::uint32_t signal_was_sent = 0;
  copy(culprit.robot, offsetof(Note, running.robot));
  copy(tick, offsetof(Note, running.tick));
  copy(signal_was_sent, offsetof(Note, signal_was_sent));
  culprit.tick = Tick{tick};
  if (signal_was_sent != 0 || culprit.robot == BehavioursEngine::kNobody) return std::nullopt;
  return culprit;
}

}  // namespace kilotwin::behaviours
