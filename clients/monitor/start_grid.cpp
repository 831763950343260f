#include "clients/monitor/start_grid.hpp"

#include <algorithm>
#include <numeric>

namespace kilotwin::monitor {
std::optional<std::size_t> StartGrid::advance(Tick now) {
  if (now.count() % every_ != 0) return std::nullopt;
  const std::size_t slot = slot_to_reuse(now);
  begin_[slot] = now;
  return slot;
}

std::size_t StartGrid::slot_to_reuse(Tick now) const {
  std::array<std::size_t, kSlots> by_age;
  std::iota(by_age.begin(), by_age.end(), std::size_t{0});
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    if (!is_used(slot)) return slot;
  }
  std::sort(by_age.begin(), by_age.end(), [this](std::size_t a, std::size_t b) { return begin(a) > begin(b); });
  if (now - begin(by_age.back()) > oldest_) return by_age.back();
  // Remove the start whose neighbours in age are nearest to each other, by ratio. The new start counts as of half an interval.
  std::size_t best = 1;
  double least = 1e300;
  for (std::size_t i = 0; i + 1 < kSlots; ++i) {
    const double younger =
        i == 0 ? static_cast<double>(every_) / 2 : static_cast<double>(now - begin(by_age[i - 1]));
    const double ratio = static_cast<double>(now - begin(by_age[i + 1])) / younger;
    if (ratio < least) {
      least = ratio;
      best = i;
    }
  }
  return by_age[best];
}

}  // namespace kilotwin::monitor
