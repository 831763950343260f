#include "services/comm/reception_log.hpp"

#include <algorithm>

#include "idl/checkpoint.pb.h"

namespace kilotwin::comm {

void ReceptionLog::clear() {
  messages_.clear();
  crc_error_.clear();
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
      if (const std::uint16_t error = crc_error_[reception.message]; error != 0) {
        frame.message_crc_error.resize(number, 0);
        frame.message_crc_error.push_back(error);
      }
    }
    frame.reception_robot.push_back(reception.robot);
    frame.reception_message.push_back(number);
    frame.reception_high_gain.push_back(reception.gains.high);
    frame.reception_low_gain.push_back(reception.gains.low);
  }
  if (!frame.message_crc_error.empty()) frame.message_crc_error.resize(frame.messages.size(), 0);
}

}  // namespace kilotwin::comm
