#include "services/ark/run_metrics.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::ark {

RunMetrics::RunMetrics(const RunPlan& plan, const dds::Participant& participant, Tick first, std::uint64_t chain)
    : plan_(plan),
      hashes_(plan.federates(), first, chain),
      accounts_(plan.federates(), Account{.next = first}),
      reader_(participant, topics::metrics(), [this](const WireMetrics& metrics, dds::SampleState state) {
        if (state.valid && metrics.run == plan_.run() && metrics.publisher < accounts_.size()) on_metrics(metrics);
      }) {}

/// Metrics of one federate follow each other without a gap, and none goes past the run's end.
bool RunMetrics::fits(const WireMetrics& metrics, const Account& account) const {
  const std::uint32_t pairs = metrics.pair_receiver._length;
  const auto all_robots = [&](const auto& sequence) {
    return std::all_of(sequence._buffer, sequence._buffer + sequence._length,
                       [this](std::uint32_t robot) { return robot < plan_.robots(); });
  };
  const std::uint32_t radios = metrics.robot_attempted._length;
  return (radios == 0 || radios == plan_.robots()) && metrics.robot_sent._length == radios &&
         metrics.robot_received._length == radios && metrics.robot_collided._length == radios &&
         metrics.robot_backed_off._length == radios && !account.last &&
         metrics.first_tick == account.next.count() &&
         metrics.hash_parts._length <= plan_.last_tick + 1 - account.next && metrics.pair_sender._length == pairs &&
         metrics.pair_count._length == pairs && all_robots(metrics.pair_receiver) &&
         all_robots(metrics.pair_sender);
}

void RunMetrics::on_metrics(const WireMetrics& metrics) {
  const std::lock_guard lock(mutex_);
  Account& account = accounts_[metrics.publisher];
  // Every process of a federate begins with an empty sample, and a second process of one leaves soon after it.
  if (account.heard && metrics.hash_parts._length == 0 && !metrics.last) return;
  if (!fits(metrics, account)) {
    if (malformed_.empty())
      malformed_ =
          fmt::format("{}: a metrics sample does not fit the run", plan_.name(FederateId{metrics.publisher}));
    return;
  }
  account.next = account.next + metrics.hash_parts._length;
  account.heard = true;
  account.last = metrics.last;
  account.step_ns = metrics.step_ns;
  account.exchange_ns = metrics.exchange_ns;
  account.wait_ns = metrics.wait_ns;
  account.cpu_ns = metrics.cpu_ns;
  account.peak_memory_kib = metrics.peak_memory_kib;
  account.robots_failed = metrics.robots_failed;
  account.bodies_without_space = metrics.bodies_without_space;
  account.attempted = metrics.attempted;
  account.sent = metrics.sent;
  account.received = metrics.received;
  account.collided = metrics.collided;
  for (std::uint32_t i = 0; i < metrics.pair_count._length; ++i) {
    account.pairs.push_back(
        {metrics.pair_receiver._buffer[i], metrics.pair_sender._buffer[i], metrics.pair_count._buffer[i]});
  }
  for (std::uint32_t i = 0; i < metrics.robot_attempted._length; ++i) {
    account.radios.push_back({metrics.robot_attempted._buffer[i], metrics.robot_sent._buffer[i],
                              metrics.robot_received._buffer[i], metrics.robot_collided._buffer[i],
                              metrics.robot_backed_off._buffer[i]});
  }
  if (const auto& octets = metrics.observations; octets._length != 0)
    observations_.emplace_back(reinterpret_cast<const char*>(octets._buffer), octets._length);  // NOLINT
  if (metrics.hash_parts._length != 0) {
    parts_.emplace_back(Tick{metrics.first_tick},
                        std::vector<std::uint64_t>(metrics.hash_parts._buffer,
                                                   metrics.hash_parts._buffer + metrics.hash_parts._length));
  }
}

void RunMetrics::advance(RunObserver& observer, const std::function<void(Tick, std::uint64_t)>& each) {
  std::vector<std::pair<Tick, std::vector<std::uint64_t>>> parts;
  std::vector<std::string> observations;
  {
    const std::lock_guard lock(mutex_);
    if (!malformed_.empty()) throw RunError(malformed_);
    parts.swap(parts_);
    observations.swap(observations_);
  }
  for (const std::string& octets : observations) {
    proto::Observations observed;
    if (!observed.ParseFromString(octets))
      throw RunError("a metrics sample holds observations that cannot be read");
    observer.observed(observed);
  }
  for (const auto& [tick, values] : parts) KILOTWIN_DEMAND(hashes_.add(tick, values));
  while (hashes_.advance()) each(hashes_.tick(), hashes_.chain());
}

bool RunMetrics::heard_all() {
  const std::lock_guard lock(mutex_);
  return std::all_of(accounts_.begin(), accounts_.end(), [](const Account& account) { return account.heard; });
}

bool RunMetrics::complete() {
  const std::lock_guard lock(mutex_);
  return std::all_of(accounts_.begin(), accounts_.end(), [](const Account& account) { return account.last; });
}

Work RunMetrics::work_of(std::uint32_t federate) const {
  if (federate < plan_.radio().value()) return Work::kPhysics;
  if (federate == plan_.radio().value()) return Work::kRadio;
  return federate == plan_.station().value() ? Work::kStation : Work::kBehaviours;
}

void RunMetrics::fill(RunTotals& totals) {
  const std::lock_guard lock(mutex_);
  totals.cpu_s = totals.peak_memory_mib = 0;
  totals.attempted = totals.sent = totals.received = totals.collided = 0;
  totals.robots_failed = 0;
  totals.tracking.bodies_without_space = 0;
  totals.work_ns = {};
  totals.federates.clear();
  totals.pairs.clear();
  totals.radios.clear();
  for (std::uint32_t i = 0; i < accounts_.size(); ++i) {
    const Account& account = accounts_[i];
    totals.cpu_s += static_cast<double>(account.cpu_ns) * 1e-9;
    totals.peak_memory_mib += account.peak_memory_kib / 1024.0;
    totals.attempted += account.attempted;
    totals.sent += account.sent;
    totals.received += account.received;
    totals.collided += account.collided;
    totals.robots_failed += account.robots_failed;
    totals.tracking.bodies_without_space += account.bodies_without_space;
    totals.work_ns[static_cast<std::size_t>(work_of(i))] += account.step_ns;
    totals.work_ns[static_cast<std::size_t>(Work::kExchange)] += account.exchange_ns;
    totals.federates.push_back({plan_.name(FederateId{i}), static_cast<double>(account.step_ns) * 1e-9,
                                static_cast<double>(account.exchange_ns) * 1e-9,
                                static_cast<double>(account.wait_ns) * 1e-9});
    totals.pairs.insert(totals.pairs.end(), account.pairs.begin(), account.pairs.end());
    totals.radios.insert(totals.radios.end(), account.radios.begin(), account.radios.end());
  }
}

}  // namespace kilotwin::ark
