/// The robots' current and recent transmissions, indexed by position.
#pragma once

#include <cstdint>
#include <vector>

#include "services/comm/air.hpp"
#include "services/comm/link_table.hpp"
#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {

class Channel {
 public:
  Channel(const Neighbourhood& neighbourhood, LinkTable& links)
      : neighbourhood_(neighbourhood), links_(links), newest_(neighbourhood.cells(), kNone) {}

  /// Rebuilds the index from the senders' current positions.
  void locate();
  void add(const Transmission&);
  /// Removes transmissions that ended by `t`. Call locate() before the next search.
  void forget(Cycles t) {
    std::erase_if(all_, [t](const Transmission& x) { return x.end <= t; });
  }

  /// In the order in which they were added.
  [[nodiscard]] std::vector<Transmission>& all() { return all_; }
  [[nodiscard]] const std::vector<Transmission>& all() const { return all_; }

  /// Carrier sense: whether `robot` detects another robot's transmission at `t`.
  [[nodiscard]] bool busy(std::uint32_t robot, Cycles t) {
    bool found = false;
    visit_near(robot, 1, [&](const Transmission& x) {
      found = found || (x.sensed_at(t) && x.sender != robot && links_.notices(robot, x.sender));
    });
    return found;
  }
  /// Calls f(transmission) for the transmissions whose senders detect a start pulse of `robot` at `t`, in any order.
  template <class F> void visit_interrupted(std::uint32_t robot, Cycles t, F f) {
    visit_near(robot, 1, [&](Transmission& x) {
      if (x.notices(t) && x.sender != robot && links_.notices(x.sender, robot)) f(x);
    });
  }
  /// Sets `found` to the other senders that transmit in [from, until) close enough to `robot` that a third robot may hear
  /// both.
  void find_rivals(std::uint32_t robot, Cycles from, Cycles until, std::vector<std::uint32_t>& found);

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  template <class F> void visit_near(std::uint32_t robot, std::uint32_t ranges, F f) {
    neighbourhood_.visit_cells(robot, ranges, [&](std::uint32_t cell) {
      for (std::uint32_t i = newest_[cell]; i != kNone; i = older_[i]) f(all_[i]);
    });
  }
  void index(std::uint32_t index);

  const Neighbourhood& neighbourhood_;
  LinkTable& links_;
  std::vector<Transmission> all_;
  std::vector<std::uint32_t> older_;   ///< per transmission: index of the next one in its cell, or kNone
  std::vector<std::uint32_t> newest_;  ///< per cell: index of its first transmission, or kNone
};

}  // namespace kilotwin::comm
