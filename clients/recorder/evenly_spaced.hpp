/// A bounded number of evenly spaced values out of a sequence of unknown length.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace kilotwin::recorder {

/// Keeps the first value and each stride-th one. When `most` are kept, it drops every second and doubles the stride.
template <class Value> class EvenlySpaced {
 public:
  explicit EvenlySpaced(std::size_t most) : most_(most) {}

  /// Moves on to the next value of the sequence. If true, the caller must keep() it.
  [[nodiscard]] bool wants_next() {
    if (next_++ % stride_ != 0) return false;
    if (kept_.size() < most_) return true;
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) std::swap(kept_[i], kept_[2 * i]);
    kept_.resize((kept_.size() + 1) / 2);
    stride_ *= 2;
    return (next_ - 1) % stride_ == 0;
  }
  void keep(Value value) { kept_.push_back(std::move(value)); }

  [[nodiscard]] const std::vector<Value>& values() const { return kept_; }

 private:
  std::size_t most_;
  std::uint64_t next_ = 0, stride_ = 1;
  std::vector<Value> kept_;
};

}  // namespace kilotwin::recorder
