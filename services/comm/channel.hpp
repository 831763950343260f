/// The robots' transmissions of now and just before, found by place.
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

  /// Files all transmissions by where their senders are now.
  void locate();
  void add(const Transmission&);
  /// Forgets what is over at `t`. Call locate() before the next search.
  void forget(Cycles t) {
    std::erase_if(all_, [t](const Transmission& x) { return x.end <= t; });
  }

  /// In the order in which they were added.
  [[nodiscard]] std::vector<Transmission>& all() { return all_; }
  [[nodiscard]] const std::vector<Transmission>& all() const { return all_; }

  /// Whether `robot` notices at `t` that another one sends.
  [[nodiscard]] bool busy(std::uint32_t robot, Cycles t) {
    bool found = false;
    visit_near(robot, 1, [&](const Transmission& x) {
      found = found || (x.sensed_at(t) && x.sender != robot && links_.notices(robot, x.sender));
    });
    return found;
  }
  /// Calls f(transmission) for the transmissions whose senders notice a start pulse of `robot` at `t`, in no particular order.
  template <class F> void visit_interrupted(std::uint32_t robot, Cycles t, F f) {
    visit_near(robot, 1, [&](Transmission& x) {
      if (x.notices(t) && x.sender != robot && links_.notices(x.sender, robot)) f(x);
    });
  }
  /// The senders that transmit in [from, until) so close to `robot` that a third robot may hear both; `robot` itself is
  /// left out, in `found`.
  void find_rivals(std::uint32_t robot, Cycles from, Cycles until, std::vector<std::uint32_t>& found);

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  template <class F> void visit_near(std::uint32_t robot, std::uint32_t ranges, F f) {
    neighbourhood_.visit_cells(robot, ranges, [&](std::uint32_t cell) {
      for (std::uint32_t i = newest_[cell]; i != kNone; i = older_[i]) f(all_[i]);
    });
  }
  void file(std::uint32_t index);

  const Neighbourhood& neighbourhood_;
  LinkTable& links_;
  std::vector<Transmission> all_;
  std::vector<std::uint32_t> older_;   ///< per transmission: the next one in its cell
  std::vector<std::uint32_t> newest_;  ///< per cell: its first transmission
};

}  // namespace kilotwin::comm
