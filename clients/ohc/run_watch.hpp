/// Whether a run is on the domain, and which.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

#include "core/federation/topics.hpp"

namespace kilotwin::ohc {

class RunWatch {
 public:
  explicit RunWatch(const dds::Participant& participant);

  /// Name of the run that has started and not ended; nothing where there is none.
  [[nodiscard]] std::optional<std::string> run() const;
  /// When the last status of that run came.
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> heard() const;

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool has_run() const;

  mutable std::mutex mutex_;
  std::optional<PublicRunStatus> status_;
  Clock::time_point heard_{};  ///< when the last status came
  dds::Reader<PublicRunStatus> reader_;
};

/// Says, once per change, for whom `kilotwin ohc` waits, or which run it has found.
class RunAnnouncer {
 public:
  RunAnnouncer(const RunWatch& watch, std::uint32_t domain) : watch_(watch), domain_(domain) {}
  /// Returns whether there is a run.
  bool look();

 private:
  const RunWatch& watch_;
  const std::uint32_t domain_;
  std::optional<std::string> said_;  ///< empty: that there is none
};

}  // namespace kilotwin::ohc
