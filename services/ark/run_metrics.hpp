/// The metrics of a federated run: what the federates' metrics add up to.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "core/federation/hash_sums.hpp"
#include "core/federation/run_observer.hpp"
#include "core/federation/topics.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::ark {

class RunMetrics {
 public:
  /// `chain`: H(first - 1).
  RunMetrics(const RunPlan& plan, const dds::Participant& participant, Tick first, std::uint64_t chain);

  /// Hands what federates observed to the observer, then every H that has become known to `each`. Throws RunError where a metrics
  /// sample came that cannot be ours.
  void advance(RunObserver& observer, const std::function<void(Tick, std::uint64_t chain)>& each);
  /// The last tick whose H is known, and that H.
  [[nodiscard]] Tick hash_tick() const { return hashes_.tick(); }
  [[nodiscard]] std::uint64_t chain() const { return hashes_.chain(); }
  /// Every federate has sent its first metrics: from then on none is lost.
  [[nodiscard]] bool heard_all();
  /// Every federate has sent its last metrics.
  [[nodiscard]] bool complete();
  /// Fills in the totals so far; fields that the metrics do not know are left alone.
  void fill(RunTotals& totals);

 private:
  struct Account {
    Tick next;  ///< of the hash parts that come next
    bool heard = false, last = false;
    std::uint64_t step_ns = 0, exchange_ns = 0, wait_ns = 0, cpu_ns = 0;
    std::uint32_t peak_memory_kib = 0, robots_failed = 0, bodies_without_space = 0;
    std::uint64_t attempted = 0, sent = 0, received = 0, collided = 0;
    std::vector<PairCount> pairs{};
    std::vector<RadioCount> radios{};
  };
  void on_metrics(const WireMetrics&);
  [[nodiscard]] bool fits(const WireMetrics&, const Account&) const;
  [[nodiscard]] Work work_of(std::uint32_t federate) const;

  const RunPlan& plan_;
  HashSums hashes_;   // own thread
  std::mutex mutex_;  // guards what follows
  std::vector<Account> accounts_;
  std::vector<std::pair<Tick, std::vector<std::uint64_t>>> parts_;  // not yet in hashes_
  std::vector<std::string> observations_;                           // not yet handed on
  std::string malformed_;                                           // the first malformed sample
  dds::Reader<WireMetrics> reader_;
};

}  // namespace kilotwin::ark
