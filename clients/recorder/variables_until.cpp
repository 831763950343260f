#include "clients/recorder/variables_until.hpp"

#include <algorithm>

namespace kilotwin::recorder {

VariablesUntil::VariablesUntil(Reader& reader, const StateIndex& index)
    : reader_(reader), index_(index), taken_(static_cast<std::size_t>(reader.header().variable_size()), 0) {}

void VariablesUntil::take(std::int64_t tick, SwarmObservables& to) {
  constexpr std::size_t kMostRecords = 256;
  for (std::size_t v = 0; v < taken_.size(); ++v) {
    const std::vector<StateIndex::Entry>& all = index_.variable(v);
    const auto end = std::upper_bound(all.begin(), all.end(), tick,
                                      [](std::int64_t wanted, const auto& entry) { return wanted < entry.tick; });
    const auto until = static_cast<std::size_t>(end - all.begin());
    std::size_t at = std::max(taken_[v], until - std::min(until, kMostRecords));
    for (; at < until; ++at) {
      reader_.go_to(all[at].offset);
      const proto::Record* const record = reader_.next();
      if (record != nullptr && record->has_variable()) to.take(record->variable());
    }
    taken_[v] = std::max(taken_[v], until);
  }
}

}  // namespace kilotwin::recorder
