/// Adds up the federates' shares of h(t), in whatever order they come, and chains the sums.
#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "core/base/time.hpp"

namespace kilotwin {

/// The first tick that enters the chain of a run which starts at `first`: tick 0 itself, but not a checkpoint's tick, which
/// is in the chain already.
[[nodiscard]] constexpr Tick first_hashed(Tick first) { return first > Tick{0} ? first + 1 : first; }

class HashSums {
 public:
  /// `federates` shares make up a sum. The chain starts with `chain` as H(first - 1).
  HashSums(std::uint32_t federates, Tick first, std::uint64_t chain)
      : federates_(federates), next_(first), chain_(chain) {}

  /// One federate's shares of h(from), h(from + 1)... False where a share comes twice or too late.
  bool add(Tick from, std::span<const std::uint64_t> parts);
  /// Moves on by one tick if its sum is complete.
  bool advance();
  /// The last tick whose H is known; first - 1 before the first advance.
  [[nodiscard]] Tick tick() const { return next_ - 1; }
  /// H(tick()).
  [[nodiscard]] std::uint64_t chain() const { return chain_; }

 private:
  struct Sum {
    std::uint64_t sum = 0;
    std::uint32_t shares = 0;
  };
  std::uint32_t federates_;
  Tick next_;
  std::uint64_t chain_;
  std::deque<Sum> sums_;  // of next_, next_ + 1, ...
};

}  // namespace kilotwin
