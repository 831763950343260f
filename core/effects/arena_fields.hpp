/// Arena fields: grids of values that robots leave in the arena, as far as one partition needs them.
///
/// Every partition within reach of a cell keeps the cell and computes it completely: it knows all robots in the cell. In the
/// step from tick k, reading and counting use the values of tick k; the result holds at k+1. The partition whose rectangle
/// contains a cell's centre hashes and saves the cell.
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
  /// Keeps the cells within `reach_mm` of the partition's rectangle. Their values are exact if all robots in these cells are
  /// known.
  ArenaFields(const RunPlan&, PartitionId, double reach_mm);

  [[nodiscard]] bool any() const { return !fields_.empty(); }
  /// Distance from a position within which robots may be in the same cell, mm.
  [[nodiscard]] static double margin_mm(const RunPlan&);

  /// Value that a robot reads of the cell at a position within reach, at tick `now`.
  [[nodiscard]] double value(std::uint32_t field, std::uint32_t robot, double x_mm, double y_mm, Tick now) const;
  /// Counts the robots for the step from tick `now`. Fields of VISITS write the cell into `memory`, which is also the memory
  /// of `robots`.
  void count(Tick now, const RobotColumns& robots, std::span<double> memory);

  /// Sum of entity_hash over own cells with a value.
  [[nodiscard]] std::uint64_t hash_part() const { return hash_; }
  /// Appends own cells with a value.
  void save(proto::PhysicsState&) const;
  /// Reads its cells from the state of all partitions. Throws RunError if a cell is unknown.
  void load(std::span<const proto::PhysicsState* const> parts);

 private:
  struct Cell {
    double value = 0;       ///< TRAIL: 1 + number of the robot that passed
    std::int64_t tick = 0;  ///< tick for which `value` holds; it decays afterwards. TRAIL: of the passage
  };
  struct Field {
    ArenaFieldSettings::Counts counts;
    double cells_per_mm, x0_mm, y0_mm;
    double forget_ticks;                                   ///< time constant of the decay; 0: none
    std::uint32_t columns, rows;                           ///< of the whole arena
    std::uint32_t first_column, first_row, width, height;  ///< of the part that is kept
    std::uint32_t slot;                                    ///< slot of the robots' memory, for VISITS
    std::vector<Cell> cells;                               ///< TRAIL: two per cell, the later passage first
  };

  /// Index of the cell in the arena; positions outside belong to the outermost cells.
  [[nodiscard]] static std::uint32_t cell_of(const Field&, double x_mm, double y_mm);
  /// Index of the cell's first entry in Field::cells; -1: not kept.
  [[nodiscard]] static std::int64_t index_of(const Field&, std::uint32_t cell);
  [[nodiscard]] bool is_own(const Field&, std::uint32_t cell) const;
  [[nodiscard]] static double faded(const Field&, const Cell&, Tick now);
  /// Enters a passage; the robots of a tick come in ascending order.
  static void pass(Cell* cell, std::uint32_t robot, Tick now);
  [[nodiscard]] std::uint64_t hash_of(std::uint32_t field, std::uint32_t number, const Cell* cell) const;

  const RunPlan& plan_;
  PartitionId partition_;
  std::vector<Field> fields_;
  std::uint64_t hash_ = 0;
};

}  // namespace kilotwin
