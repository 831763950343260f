/// What places remember: the fields of the arena, as far as one partition needs them.
///
/// A cell is kept by every partition in whose reach it lies, and each of them computes it whole: it knows all robots in the
/// cell. Reading and counting in the step from tick k see the values of tick k; those of k+1 are the result. A cell is hashed
/// and saved by the one partition in whose rectangle its centre lies.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/effects/robots.hpp"
#include "core/plan/effect_settings.hpp"

namespace kilotwin {

namespace proto {
class PhysicsState;
}

class ArenaFields {
 public:
  /// Values within `reach_mm` of the partition's rectangle can be read. They are right where all robots that are in a cell
  /// are known.
  ArenaFields(const RunPlan&, PartitionId, double reach_mm);

  [[nodiscard]] bool any() const { return !fields_.empty(); }
  /// Of a place, mm: robots this near may be in its cell.
  [[nodiscard]] static double margin_mm(const RunPlan&);

  /// Of the cell of a place within reach, at tick `now`.
  [[nodiscard]] double value(std::uint32_t field, double x_mm, double y_mm, Tick now) const;
  /// Counts the robots of the step from tick `now`. VISITS note the cell in the robots' `memory`, a view of which `robots`
  /// holds.
  void count(Tick now, const RobotColumns& robots, std::span<double> memory);

  /// Sum of entity_hash over own cells that hold something.
  [[nodiscard]] std::uint64_t hash_part() const { return hash_; }
  /// Appends own cells that hold something.
  void save(proto::PhysicsState&) const;
  /// Takes its cells out of what all partitions saved. Throws RunError where a cell is unknown.
  void load(std::span<const proto::PhysicsState* const> parts);

 private:
  struct Cell {
    double value = 0;
    std::int64_t tick = 0;  ///< for which the value holds; later ones forget
  };
  struct Field {
    ArenaFieldSettings::Counts counts;
    double cells_per_mm, x0_mm, y0_mm;
    double forget_ticks;                                   ///< 0: never
    std::uint32_t columns, rows;                           ///< of the arena
    std::uint32_t first_column, first_row, width, height;  ///< of what is kept
    std::uint32_t slot;                                    ///< of memory, with VISITS
    std::vector<Cell> cells;
  };

  /// Number of the cell in the arena; places outside belong to the outermost cells.
  [[nodiscard]] static std::uint32_t cell_of(const Field&, double x_mm, double y_mm);
  /// Where the cell is kept; -1: not here.
  [[nodiscard]] static std::int64_t index_of(const Field&, std::uint32_t cell);
  [[nodiscard]] bool is_own(const Field&, std::uint32_t cell) const;
  [[nodiscard]] static double faded(const Field&, const Cell&, Tick now);
  [[nodiscard]] static std::uint64_t hash_of(std::uint32_t field, std::uint32_t cell, const Cell&);

  const RunPlan& plan_;
  PartitionId partition_;
  std::vector<Field> fields_;
  std::uint64_t hash_ = 0;
};

}  // namespace kilotwin
