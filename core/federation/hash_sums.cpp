#include "core/federation/hash_sums.hpp"

#include "core/base/state_hash.hpp"

namespace kilotwin {

bool HashSums::add(Tick from, std::span<const std::uint64_t> parts) {
  const std::int64_t offset = from - next_;
  if (offset < 0) return parts.empty();
  const std::size_t needed = static_cast<std::size_t>(offset) + parts.size();
  if (sums_.size() < needed) sums_.resize(needed);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    Sum& sum = sums_[static_cast<std::size_t>(offset) + i];
    if (sum.shares == federates_) return false;
    sum.sum += parts[i];
    ++sum.shares;
  }
  return true;
}

bool HashSums::advance() {
  if (sums_.empty() || sums_.front().shares != federates_) return false;
  chain_ = hash_chain(chain_, sums_.front().sum);
  sums_.pop_front();
  ++next_;
  return true;
}

}  // namespace kilotwin
