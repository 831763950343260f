/// Whom each robot's light reaches, and with what margin: computed when a robot is asked for, and remembered while nobody
/// around it moves. What is remembered is a pure function of poses, so that it never shows in a result.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/comm/link_budget.hpp"
#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {

class LinkTable {
 public:
  struct Link {
    std::uint32_t receiver;
    float margin_db;
  };

  LinkTable(Neighbourhood&, LinkBudget&);

  /// Whether links are tabled at all: where distance alone decides, there is nothing to remember.
  [[nodiscard]] bool used() const { return !row_.empty(); }
  /// A tick begins. Then robots move, and when they have the neighbourhood is sorted.
  void begin_tick() { ++now_; }
  void move(std::uint32_t robot, double x_mm, double y_mm, double heading_rad);
  /// The robots that notice a sender, or may receive single packets of it; in no particular order.
  [[nodiscard]] std::span<const Link> of(std::uint32_t sender) {
    if (checked_[sender] != now_) refresh(sender);
    return row_[sender];
  }
  [[nodiscard]] bool notices(std::uint32_t receiver, std::uint32_t sender);
  /// Forgets everything.
  void clear();

 private:
  void refresh(std::uint32_t sender);

  Neighbourhood& neighbourhood_;
  LinkBudget& links_;
  std::uint32_t now_ = 1;               ///< counts ticks
  std::vector<std::uint32_t> touched_;  ///< per cell: when something last changed there
  std::vector<std::uint32_t> built_;    ///< per robot: when its row was computed; 0: never
  std::vector<std::uint32_t> checked_;  ///< per robot: when its row was last known to hold
  std::vector<std::vector<Link>> row_;  ///< per sender
};

}  // namespace kilotwin::comm
