/// RunControl: steers the run on a DDS domain, and says how it goes. The program's part of topic kilotwin/run_control.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "core/federation/topics.hpp"
#include "core/frames/frames.hpp"

namespace kilotwin::cli {

class RunControl {
 public:
  using Status = PublicRunStatus;

  explicit RunControl(std::uint32_t domain);

  /// Waits until the run on the domain has said how it goes, and returns that. After a second it says on stderr for what it waits.
  /// Throws RunError after `patience`, and where two runs share the domain.
  Status find(std::chrono::duration<double> patience);
  /// Sends a command to the run of find(), and waits until the station has it. Throws RunError after `patience`.
  void send(kilotwin_open_RunCommand command, std::uint32_t steps, std::chrono::duration<double> patience);
  /// Places a robot or a movable body of the run of find() elsewhere, and waits until the run shows it there; where the run is
  /// paused, until the station has the request. Throws RunError after `patience`.
  void place(const Relocation& where, std::chrono::duration<double> patience);
  /// Waits until the run's status satisfies `done`, or the run is over, and returns the last status. Throws RunError after
  /// `patience`: "the run ... did not WHAT within ... s; it is at ... s", and the hint, if there is one: what may be done.
  Status await(const std::function<bool(const Status&)>& done, const std::string& what,
               std::chrono::duration<double> patience, const std::string& hint = "");

 private:
  /// Sends a request of this client, and waits until the station has it.
  template <class Sample>
  void write(dds::Writer<Sample>& writer, Sample& sample, std::chrono::steady_clock::time_point until);
  void on_status(const Status& sample, dds::SampleState state);

  const std::uint32_t domain_;
  const std::string client_;
  std::uint32_t requests_ = 0;
  std::mutex mutex_;  // guards what follows, up to gone_
  std::condition_variable arrived_;
  std::optional<Status> status_;
  bool several_ = false, gone_ = false;
  dds::Participant participant_;
  dds::Writer<PublicRunControl> control_;
  dds::Writer<PublicRelocation> relocations_;
  dds::Reader<Status> reader_;
};

/// Whether a run in this phase goes no further.
[[nodiscard]] inline bool is_over(kilotwin_open_RunPhase phase) {
  return phase == kilotwin_open_ENDED || phase == kilotwin_open_BROKEN;
}

}  // namespace kilotwin::cli
