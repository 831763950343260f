/// Receivers of each robot's light, with their margins: computed on demand, and cached while no robot nearby moves. Entries
/// are pure functions of poses, so the cache never affects a result.
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

  /// Whether the table is in use: if distance alone decides, there is nothing to cache.
  [[nodiscard]] bool used() const { return !row_.empty(); }
  /// Begins a tick. Call move() for the robots that moved next, then sort the neighbourhood.
  void begin_tick() { ++now_; }
  void move(std::uint32_t robot, double x_mm, double y_mm, double heading_rad);
  /// Robots that sense a sender, or may receive single packets from it; in any order.
  [[nodiscard]] std::span<const Link> of(std::uint32_t sender) {
    if (checked_[sender] != now_) refresh(sender);
    return row_[sender];
  }
  [[nodiscard]] bool notices(std::uint32_t receiver, std::uint32_t sender);
  /// Empties the cache.
  void clear();

 private:
  void refresh(std::uint32_t sender);

  Neighbourhood& neighbourhood_;
  LinkBudget& links_;
  std::uint32_t now_ = 1;               ///< number of ticks
  std::vector<std::uint32_t> touched_;  ///< per cell: tick of the last change there
  std::vector<std::uint32_t> built_;    ///< per robot: tick in which its row was computed; 0: never
  std::vector<std::uint32_t> checked_;  ///< per robot: last tick in which its row was known to be valid
  std::vector<std::vector<Link>> row_;  ///< per sender
};

}  // namespace kilotwin::comm
