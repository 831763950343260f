/// Number of messages per pair of robots since the start.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/radio_counts.hpp"

namespace kilotwin::comm {

class PairCounts {
 public:
  explicit PairCounts(std::uint32_t robots) : of_receiver_(robots) {}

  void add(std::uint32_t receiver, std::uint32_t sender, std::uint32_t count = 1) {
    std::vector<Count>& counts = of_receiver_[receiver];
    std::size_t at = 0;
    for (std::size_t length = counts.size(); length > 0;) {  // binary search
      const std::size_t half = length / 2;
      const bool right = counts[at + half].sender < sender;
      at = right ? at + half + 1 : at;
      length = right ? length - half - 1 : half;
    }
    if (at == counts.size() || counts[at].sender != sender) {
      counts.insert(counts.begin() + static_cast<std::ptrdiff_t>(at), {sender, 0});
    }
    counts[at].count += count;
  }
  /// Sorted by receiver, then by sender.
  [[nodiscard]] std::vector<PairCount> all() const {
    std::vector<PairCount> result;
    for (std::uint32_t receiver = 0; receiver < of_receiver_.size(); ++receiver) {
      for (const Count& c : of_receiver_[receiver]) result.push_back({receiver, c.sender, c.count});
    }
    return result;
  }
  void clear() { of_receiver_.assign(of_receiver_.size(), {}); }

 private:
  struct Count {
    std::uint32_t sender, count;
  };
  std::vector<std::vector<Count>> of_receiver_;  ///< per receiver, in ascending order of senders
};

}  // namespace kilotwin::comm
