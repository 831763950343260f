/// The wall time of a run's federates, for viewers: how long each computes, and for whom it waits.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "core/federation/run_observer.hpp"
#include "core/federation/topics.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {
namespace recorder {
struct Summary;
}

namespace view {

/// A message of type "work". `live`: of the last seconds, else of the whole run.
[[nodiscard]] std::string work_text(bool live, const std::vector<FederateTime>& federates);
/// The same of a run that has ended, with its cost by subject, ns per robot and tick, its messages and its mean speed.
[[nodiscard]] std::string work_text(const recorder::Summary& summary);

/// The last seconds of a live run, from the metrics of its federates.
class LiveWork {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kWindow = std::chrono::seconds(4);

  void take(const WireMetrics& metrics, Clock::time_point now);
  /// Of federates that have reported twice.
  [[nodiscard]] std::vector<FederateTime> recent(const RunPlan& plan) const;
  void clear() { reports_.clear(); }

 private:
  struct Report {
    Clock::time_point when;
    std::uint64_t step_ns, exchange_ns, wait_ns;
  };
  std::map<std::uint32_t, std::deque<Report>> reports_;  // by federate
};

}  // namespace view
}  // namespace kilotwin
