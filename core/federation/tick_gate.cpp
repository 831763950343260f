#include "core/federation/tick_gate.hpp"

#include <algorithm>

namespace kilotwin {

TickGate::TickGate(std::vector<FederateId> publishers, Tick first)
    : publishers_(std::move(publishers)),
      newest_(publishers_.size(), first - 1),
      reading_(first),
      hello_(publishers_.size(), false) {
  std::sort(publishers_.begin(), publishers_.end());
}

std::ptrdiff_t TickGate::index_of(FederateId publisher) const {
  const auto found = std::lower_bound(publishers_.begin(), publishers_.end(), publisher);
  return found != publishers_.end() && *found == publisher ? found - publishers_.begin() : -1;
}

bool TickGate::hello(FederateId publisher) {
  const std::ptrdiff_t index = index_of(publisher);
  if (index < 0) return false;
  hello_[static_cast<std::size_t>(index)] = true;
  return true;
}

TickGate::Arrival TickGate::arrival(FederateId publisher, Tick tick) const {
  const std::ptrdiff_t index = index_of(publisher);
  if (index < 0) return Arrival::kUnexpected;
  const Tick newest = newest_[static_cast<std::size_t>(index)];
  if (tick <= newest) return Arrival::kRepeated;
  return tick > newest + 1 || tick - reading_ >= kFrameRing ? Arrival::kUnexpected : Arrival::kNew;
}

bool TickGate::accept(FederateId publisher, Tick tick) {
  if (arrival(publisher, tick) != Arrival::kNew) return false;
  newest_[static_cast<std::size_t>(index_of(publisher))] = tick;
  return true;
}

bool TickGate::heard_all() const {
  return std::all_of(hello_.begin(), hello_.end(), [](bool heard) { return heard; });
}

bool TickGate::ready(Tick tick) const {
  return std::all_of(newest_.begin(), newest_.end(), [tick](Tick newest) { return newest >= tick; });
}

std::vector<FederateId> TickGate::missing(Tick tick) const {
  std::vector<FederateId> result;
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (newest_[i] < tick) result.push_back(publishers_[i]);
  }
  return result;
}

std::vector<FederateId> TickGate::unheard() const {
  std::vector<FederateId> result;
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (!hello_[i]) result.push_back(publishers_[i]);
  }
  return result;
}

}  // namespace kilotwin
