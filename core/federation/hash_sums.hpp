/// Sums the federates' shares of h(t), which may arrive in any order, and chains the sums: H(t) = hash_chain(H(t - 1), h(t)).
#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "core/base/time.hpp"

namespace kilotwin {

/// The first tick that enters the chain of a run that starts at `first`: tick 0, or the tick after a checkpoint, whose chain includes
/// the checkpoint's tick.
[[nodiscard]] constexpr Tick first_hashed(Tick first) { return first > Tick{0} ? first + 1 : first; }

class HashSums {
 public:
  /// `federates`: number of shares per sum. `chain`: H(first - 1).
  HashSums(std::uint32_t federates, Tick first, std::uint64_t chain)
      : federates_(federates), next_(first), chain_(chain) {}

  /// Adds one federate's shares of h(from), h(from + 1)... Returns false if a share arrives twice or too late.
  bool add(Tick from, std::span<const std::uint64_t> parts);
  /// Advances the chain by one tick if the tick's sum is complete. Returns whether it did.
  bool advance();
  /// The last tick whose H is known; first - 1 before the first advance().
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
  std::deque<Sum> sums_;  // for next_, next_ + 1, ...
};

}  // namespace kilotwin
