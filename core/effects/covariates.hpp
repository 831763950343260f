/// Covariates of robots: a column per covariate that some effect uses. Each column is computed once per tick.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/effects/arena_fields.hpp"
#include "core/effects/function.hpp"
#include "core/effects/robots.hpp"
#include "core/spatial/cell_list.hpp"

namespace kilotwin {

class Covariates {
 public:
  explicit Covariates(const RunPlan&);

  /// Requests the column of a covariate with the function's parameters and returns its index. MOTOR_TIME and DUTY need
  /// of_wheel() first.
  [[nodiscard]] std::uint32_t need(Covariate, const FunctionSettings&);
  /// Radius within which neighbours affect covariates, mm; 0 if no covariate uses neighbours.
  [[nodiscard]] double radius_mm() const { return radius_mm_; }
  /// Range of a column's values.
  [[nodiscard]] Range range(std::uint32_t column) const;

  /// Computes all columns for the robots robots[who[0]], robots[who[1]]... `robots` must have all robots within radius_mm() of
  /// those. `fields` may be null if no column is of PLACE.
  void fill(Tick, const RobotColumns& robots, std::span<const std::uint32_t> who, const ArenaFields* fields);
  [[nodiscard]] std::span<const double> values(std::uint32_t column) const { return columns_[column].values; }

  /// Per robot of `who`: a mask with the bit of its MotionCommand.
  [[nodiscard]] std::span<const std::uint8_t> command_bits() const { return command_bits_; }

  [[nodiscard]] static bool is_of_neighbours(Covariate covariate) {
    return covariate >= Covariate::kNeighbours && covariate <= Covariate::kNearestBearing;
  }

 private:
  struct Column {
    Covariate covariate = Covariate::kNothing;
    double radius_mm = 0, forget_s = 0, toward_rad = 0;
    std::uint32_t focus = 0;
    Others others = Others::kAny;
    std::vector<std::uint32_t> other_robots;  ///< ascending; empty: all
    std::uint32_t field = 0;
    std::uint32_t slot = 0;  ///< of the memory, for covariates that are stored there
    MovingPointSettings point = {};
    double along_x = 1, along_y = 0;  ///< unit vector, with kAlong
    std::vector<double> values;
  };

  void fill(Column&, Tick, const RobotColumns&, std::span<const std::uint32_t> who, const ArenaFields*) const;
  void fill_neighbours(const RobotColumns&, std::span<const std::uint32_t> who);
  /// Whether a robot counts as a neighbour in a column.
  [[nodiscard]] static bool counts(const Column&, const RobotColumns&, std::uint32_t other);

  const RunPlan& plan_;
  std::vector<Column> columns_;
  double radius_mm_ = 0;
  std::vector<std::uint8_t> command_bits_;
  std::optional<CellList> cells_;
  std::vector<std::uint32_t> found_;
};

/// The covariate of one wheel: 0 left, 1 right. The right motor drives the left wheel.
[[nodiscard]] Covariate of_wheel(Covariate, std::uint32_t wheel);

}  // namespace kilotwin
