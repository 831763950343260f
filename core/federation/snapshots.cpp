#include "core/federation/snapshots.hpp"

#include <system_error>

#include "core/federation/checkpoint.hpp"

namespace kilotwin {

bool Snapshots::due(Clock::time_point now) {
  if (!wanted_) return false;
  if (next_ == Clock::time_point{}) next_ = now + kPeriod;
  if (now < next_) return false;
  next_ = now + kPeriod;
  return true;
}

void Snapshots::taken(Tick tick) {
  constexpr std::size_t kKept = 2;
  std::error_code ignored;
  taken_.push_back(tick);
  for (; taken_.size() > kKept; taken_.pop_front())
    std::filesystem::remove_all(checkpoint_directory(run_directory_, taken_.front()), ignored);
}

void Snapshots::remove_all() {
  std::error_code ignored;
  for (; !taken_.empty(); taken_.pop_front())
    std::filesystem::remove_all(checkpoint_directory(run_directory_, taken_.front()), ignored);
  // remove() deletes the directory only if it is empty.
  if (wanted_) std::filesystem::remove(run_directory_ / "checkpoints", ignored);
}

}  // namespace kilotwin
