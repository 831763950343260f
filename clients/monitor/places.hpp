/// Evidence of patches: places where several robots are slower or faster than the model says. The arena is divided into square
/// cells. A visit of a robot to a cell adds the score and information of a gain of both wheels there.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "clients/monitor/evidence.hpp"

namespace kilotwin::monitor {

struct Visit {
  std::uint32_t robot = 0;
  double from_s = 0, to_s = 0;
  double x_mm = 0, y_mm = 0;  ///< mean position
  double score = 0, information = 0;
};

class Places {
 public:
  /// Shorter visits do not count: their number per hour bounds the number of tests.
  static constexpr double kShortestVisit_s = 1;
  /// A visit that lasts longer counts as several.
  static constexpr double kLongestVisit_s = 10;

  Places(double half_width_mm, double half_height_mm);

  [[nodiscard]] std::uint32_t cell_of(double x_mm, double y_mm) const;
  /// Whether a patch was found within `reach` sides of a cell.
  [[nodiscard]] bool is_known(double x_mm, double y_mm, double reach = 1) const;
  [[nodiscard]] double side_mm() const { return side_mm_; }

  struct Patch {
    double evidence = 0, onset_s = 0, x_mm = 0, y_mm = 0;
    Size size;
    std::vector<std::uint32_t> robots;
  };
  /// Takes a visit. Returns a patch whose evidence, without the robot that contributes most, reaches the threshold. The cell is
  /// known from then on.
  std::optional<Patch> add(std::uint32_t cell, const Visit& visit, double dispersion, double threshold);
  /// A robot slowed down or sped up enough for an alarm of its own. Returns a patch if another robot did the same nearby before.
  std::optional<Patch> add_alarm(const Visit& visit, double dispersion);
  /// Adds a place to the known patches: visits near a known patch belong to it.
  void extend(double x_mm, double y_mm) { known_.push_back({x_mm, y_mm}); }
  /// Forgets visits; known patches stay.
  void clear() {
    visits_.clear();
    alarms_.clear();
  }

 private:
  static constexpr std::size_t kMostVisits = 64;

  double half_width_mm_, half_height_mm_, side_mm_;
  std::uint32_t columns_, rows_;
  std::map<std::uint32_t, std::deque<Visit>> visits_;  ///< by cell, the newest first
  std::deque<Visit> alarms_;                           ///< the newest first
  struct Known {
    double x_mm, y_mm;
  };
  std::vector<Known> known_;
};

}  // namespace kilotwin::monitor
