/// The robots' transmissions of now and just before, found by place.
#pragma once

#include <cstdint>
#include <vector>

#include "services/comm/air.hpp"
#include "services/comm/link_budget.hpp"
#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {

class Channel {
 public:
  Channel(const Neighbourhood& neighbourhood, LinkBudget& links)
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

  /// Calls f(transmission) for the transmissions of other robots that `robot` hears, in no particular order.
  template <class F> void visit_heard(std::uint32_t robot, F f) {
    visit_near(robot, 1, [&](Transmission& x) {
      if (x.sender != robot && links_.hears(neighbourhood_, robot, x.sender)) f(x);
    });
  }
  /// Calls f(transmission) for the transmissions of other robots that hear `robot`, in no particular order.
  template <class F> void visit_hearers(std::uint32_t robot, F f) {
    visit_near(robot, 1, [&](Transmission& x) {
      if (x.sender != robot && links_.hears(neighbourhood_, x.sender, robot)) f(x);
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
  LinkBudget& links_;
  std::vector<Transmission> all_;
  std::vector<std::uint32_t> older_;   ///< per transmission: the next one in its cell
  std::vector<std::uint32_t> newest_;  ///< per cell: its first transmission
};

}  // namespace kilotwin::comm
