#include "services/comm/reception_log.hpp"

#include <algorithm>

#include "idl/checkpoint.pb.h"

namespace kilotwin::comm {

void ReceptionLog::clear() {
  messages_.clear();
  arrived_.clear();
}

void ReceptionLog::close() {
  std::fill(first_.begin(), first_.end(), 0u);
  sorted_.resize(arrived_.size());
  if (arrived_.empty()) return;
  for (const Reception& reception : arrived_) ++first_[reception.robot];
  std::uint32_t sum = 0;
  for (std::uint32_t& f : first_) {
    sum += f;
    f = sum;
  }
  // In descending order, so that the order of arrival is kept, and first_ ends at the first reception of each robot.
  for (std::size_t n = arrived_.size(); n-- > 0;) sorted_[--first_[arrived_[n].robot]] = arrived_[n];
}

void ReceptionLog::emit(Share share, RadioFrame& frame) const {
  constexpr std::uint32_t kUnnumbered = 0xffffffffu;
  number_.assign(messages_.size(), kUnnumbered);
  for (std::uint32_t n = first_[share.first]; n < first_[share.last]; ++n) {
    const Reception& reception = sorted_[n];
    std::uint32_t& number = number_[reception.message];
    if (number == kUnnumbered) {
      number = static_cast<std::uint32_t>(frame.messages.size());
      frame.messages.push_back(messages_[reception.message]);
    }
    frame.reception_robot.push_back(reception.robot);
    frame.reception_message.push_back(number);
    frame.reception_high_gain.push_back(reception.gains.high);
    frame.reception_low_gain.push_back(reception.gains.low);
  }
}

}  // namespace kilotwin::comm
