/// Counters of the radio per robot, as variables that a run can record: experiment.proto, recording.variable. Recording them
/// changes no result.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/recording_schedule.hpp"
#include "core/frames/radio_counts.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

namespace proto {
class Observations;
}

namespace comm {

struct RadioCounter {
  std::string_view name;    ///< of the recorded variable
  std::string_view counts;  ///< in words, for the reference
  std::uint32_t RadioCount::*count;
};

inline constexpr std::array<RadioCounter, 5> kRadioCounters{
    {{"radio_attempted", "start pulses", &RadioCount::attempted},
     {"radio_sent", "whole packets sent", &RadioCount::sent},
     {"radio_received", "packets received of other robots", &RadioCount::received},
     {"radio_collided", "receptions lost because packets overlapped", &RadioCount::collided},
     {"radio_backed_off", "attempts given up because another robot was sending", &RadioCount::backed_off}}};

/// nullptr: no counter has this name.
[[nodiscard]] const RadioCounter* radio_counter(std::string_view name);

class CounterSampler {
 public:
  /// For all robots with a program: others have no radio here.
  explicit CounterSampler(const RunPlan& plan);

  /// Adds the counters that are due at `now`. `counts`: per robot, since the start of the run.
  void sample(Tick now, std::span<const RadioCount> counts, proto::Observations& to) const;

 private:
  struct Recorded {
    std::uint32_t variable = 0;  ///< in the manifest
    const RadioCounter* counter = nullptr;
    RecordingSchedule schedule;
  };
  std::vector<Recorded> recorded_;
  std::vector<std::uint32_t> robots_;  ///< ascending
};

}  // namespace comm
}  // namespace kilotwin
