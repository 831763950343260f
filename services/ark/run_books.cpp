#include "services/ark/run_books.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::ark {

RunBooks::RunBooks(const RunPlan& plan, const dds::Participant& participant, Tick first, std::uint64_t chain)
    : plan_(plan),
      hashes_(plan.federates(), first, chain),
      accounts_(plan.federates(), Account{.next = first}),
      reader_(participant, topics::ledgers(), [this](const WireLedger& ledger, dds::SampleState state) {
        if (state.valid && ledger.run == plan_.run() && ledger.publisher < accounts_.size()) on_ledger(ledger);
      }) {}

/// Ledgers of one federate follow each other without a gap, and none goes past the run's end.
bool RunBooks::fits(const WireLedger& ledger, const Account& account) const {
  const std::uint32_t pairs = ledger.pair_receiver._length;
  const auto all_robots = [&](const auto& sequence) {
    return std::all_of(sequence._buffer, sequence._buffer + sequence._length,
                       [this](std::uint32_t robot) { return robot < plan_.robots(); });
  };
  const std::uint32_t radios = ledger.robot_attempted._length;
  return (radios == 0 || radios == plan_.robots()) && ledger.robot_sent._length == radios &&
         ledger.robot_received._length == radios && ledger.robot_collided._length == radios &&
         ledger.robot_backed_off._length == radios && !account.last && ledger.first_tick == account.next.count() &&
         ledger.hash_parts._length <= plan_.last_tick + 1 - account.next && ledger.pair_sender._length == pairs &&
         ledger.pair_count._length == pairs && all_robots(ledger.pair_receiver) && all_robots(ledger.pair_sender);
}

void RunBooks::on_ledger(const WireLedger& ledger) {
  const std::lock_guard lock(mutex_);
  Account& account = accounts_[ledger.publisher];
  if (!fits(ledger, account)) {
    if (malformed_.empty())
      malformed_ = fmt::format("{}: a ledger does not fit the run", plan_.name(FederateId{ledger.publisher}));
    return;
  }
  account.next = account.next + ledger.hash_parts._length;
  account.last = ledger.last;
  account.step_ns = ledger.step_ns;
  account.exchange_ns = ledger.exchange_ns;
  account.cpu_ns = ledger.cpu_ns;
  account.peak_memory_kib = ledger.peak_memory_kib;
  account.robots_failed = ledger.robots_failed;
  account.attempted = ledger.attempted;
  account.sent = ledger.sent;
  account.received = ledger.received;
  account.collided = ledger.collided;
  for (std::uint32_t i = 0; i < ledger.pair_count._length; ++i) {
    account.pairs.push_back(
        {ledger.pair_receiver._buffer[i], ledger.pair_sender._buffer[i], ledger.pair_count._buffer[i]});
  }
  for (std::uint32_t i = 0; i < ledger.robot_attempted._length; ++i) {
    account.radios.push_back({ledger.robot_attempted._buffer[i], ledger.robot_sent._buffer[i],
                              ledger.robot_received._buffer[i], ledger.robot_collided._buffer[i],
                              ledger.robot_backed_off._buffer[i]});
  }
  if (ledger.hash_parts._length != 0) {
    parts_.emplace_back(Tick{ledger.first_tick},
                        std::vector<std::uint64_t>(ledger.hash_parts._buffer,
                                                   ledger.hash_parts._buffer + ledger.hash_parts._length));
  }
}

void RunBooks::advance(const std::function<void(Tick, std::uint64_t)>& each) {
  std::vector<std::pair<Tick, std::vector<std::uint64_t>>> parts;
  {
    const std::lock_guard lock(mutex_);
    if (!malformed_.empty()) throw RunError(malformed_);
    parts.swap(parts_);
  }
  for (const auto& [tick, values] : parts) KILOTWIN_DEMAND(hashes_.add(tick, values));
  while (hashes_.advance()) each(hashes_.tick(), hashes_.chain());
}

bool RunBooks::complete() {
  const std::lock_guard lock(mutex_);
  return std::all_of(accounts_.begin(), accounts_.end(), [](const Account& account) { return account.last; });
}

Work RunBooks::work_of(std::uint32_t federate) const {
  if (federate < plan_.comm().value()) return Work::kPhysics;
  if (federate == plan_.comm().value()) return Work::kRadio;
  return federate == plan_.station().value() ? Work::kStation : Work::kBehaviours;
}

void RunBooks::fill(RunTotals& totals) {
  const std::lock_guard lock(mutex_);
  totals.cpu_s = totals.peak_memory_mib = 0;
  totals.attempted = totals.sent = totals.received = totals.collided = 0;
  totals.robots_failed = 0;
  totals.work_ns = {};
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
    totals.work_ns[static_cast<std::size_t>(work_of(i))] += account.step_ns;
    totals.work_ns[static_cast<std::size_t>(Work::kExchange)] += account.exchange_ns;
    totals.pairs.insert(totals.pairs.end(), account.pairs.begin(), account.pairs.end());
    totals.radios.insert(totals.radios.end(), account.radios.begin(), account.radios.end());
  }
}

}  // namespace kilotwin::ark
