#include "clients/recorder/ordered_records.hpp"

#include <algorithm>
#include <utility>

namespace kilotwin::recorder {

void OrderedRecords::take(const proto::Record& record) {
  if (record.has_state() && (kinds_ & kStates) != 0) {
    waiting_[record.state().tick()].state = record.state();
  } else if (record.has_variable() && (kinds_ & kVariables) != 0) {
    waiting_[record.variable().tick()].variables.push_back(record.variable());
  } else if (record.has_event() && (kinds_ & kEvents) != 0) {
    waiting_[record.event().tick()].events.push_back(record.event());
  } else if (record.has_hash() && record.hash().chain_size() > 0) {
    complete_before_ =
        std::max(complete_before_, record.hash().first_tick() + std::int64_t{record.hash().chain_size()} - 1);
  }
}

bool OrderedRecords::next() {
  while (!ended_ && (waiting_.empty() || waiting_.begin()->first >= complete_before_)) {
    const proto::Record* const record = recording_.next();
    if (record == nullptr)
      ended_ = true;
    else
      take(*record);
  }
  if (waiting_.empty()) return false;
  tick_ = Tick{waiting_.begin()->first};
  records_ = std::move(waiting_.begin()->second);
  waiting_.erase(waiting_.begin());
  return true;
}

}  // namespace kilotwin::recorder
