/// Covariates of robots, a column for each that some effect looks at. A column is filled once per tick, whoever asks for it.
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

  /// The column of a covariate with the parameters of the function; MOTOR_TIME and DUTY are those of no wheel, see of_wheel().
  [[nodiscard]] std::uint32_t need(Covariate, const FunctionSettings&);
  /// How far away robots count, mm; 0 where none do.
  [[nodiscard]] double radius_mm() const { return radius_mm_; }
  /// Where the values of a column can lie.
  [[nodiscard]] Range range(std::uint32_t column) const;

  /// Fills all columns for the robots robots[who[0]], robots[who[1]]... `robots` hold all robots within radius_mm() of
  /// those. `fields`: null where no column is of PLACE.
  void fill(Tick, const RobotColumns& robots, std::span<const std::uint32_t> who, const ArenaFields* fields);
  [[nodiscard]] std::span<const double> values(std::uint32_t column) const { return columns_[column].values; }

  /// The number of a MotionCommand as a bit, per robot of who.
  [[nodiscard]] std::span<const std::uint8_t> command_bits() const { return command_bits_; }

  [[nodiscard]] static bool is_of_neighbours(Covariate covariate) {
    return covariate >= Covariate::kNeighbours && covariate <= Covariate::kNearestBearing;
  }

 private:
  struct Column {
    Covariate covariate;
    double radius_mm = 0, forget_s = 0, toward_rad = 0;
    std::uint32_t focus = 0;
    std::uint32_t field = 0;
    std::uint32_t slot = 0;  ///< of memory, where it is remembered
    std::vector<double> values;
  };

  void fill(Column&, Tick, const RobotColumns&, std::span<const std::uint32_t> who, const ArenaFields*) const;
  void fill_neighbours(const RobotColumns&, std::span<const std::uint32_t> who);

  const RunPlan& plan_;
  std::vector<Column> columns_;
  double radius_mm_ = 0;
  std::vector<std::uint8_t> command_bits_;
  std::optional<CellList> cells_;
  std::vector<std::uint32_t> found_;
};

/// The covariate as the left (0) or the right (1) wheel has it: the right motor drives the left wheel.
[[nodiscard]] Covariate of_wheel(Covariate, std::uint32_t wheel);

}  // namespace kilotwin
