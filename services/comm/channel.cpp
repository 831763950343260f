#include "services/comm/channel.hpp"

namespace kilotwin::comm {

void Channel::locate() {
  newest_.assign(newest_.size(), kNone);
  older_.clear();
  for (std::uint32_t i = 0; i < all_.size(); ++i) index(i);
}

void Channel::add(const Transmission& transmission) {
  all_.push_back(transmission);
  index(static_cast<std::uint32_t>(all_.size() - 1));
}

void Channel::index(std::uint32_t index) {
  std::uint32_t& newest = newest_[neighbourhood_.cell_of(all_[index].sender)];
  older_.push_back(newest);
  newest = index;
}

void Channel::find_rivals(std::uint32_t robot, Cycles from, Cycles until, std::vector<std::uint32_t>& found) {
  found.clear();
  visit_near(robot, 2, [&](const Transmission& x) {
    if (x.overlaps(from, until) && x.sender != robot) found.push_back(x.sender);
  });
}

}  // namespace kilotwin::comm
