/// Signatures of hypotheses: how an effect of size 1, which begins at a start of the grid, shifts the whitened innovations of a
/// robot's filter. The sums of signature times innovation and of squared signatures are the score and the information of
/// the effect's size; docs/explanation/monitor.md has the equations.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/monitor/robot_filter.hpp"
#include "clients/monitor/start_grid.hpp"

namespace kilotwin::monitor {

/// Columns are sizes of effects. Those of one group are tested together or in combinations.
enum Column : std::uint8_t {
  kGainLeft,
  kGainRight,
  kBiasLeft,
  kBiasRight,
  kHeading,
  kDriftX,
  kDriftY,
  kShiftX,
  kShiftY,
  kShiftTurn,
  kColumns
};

/// Effects that a filter absorbs within a second begin at starts of a fine grid, all others at those of a coarse one.
enum class Family : std::uint8_t { kLasting, kAbsorbed };
[[nodiscard]] constexpr Family family_of(std::size_t column) {
  return column == kHeading || column >= kShiftX ? Family::kAbsorbed : Family::kLasting;
}

/// Pairs of columns of one group, whose information is summed; (a, b) with a <= b.
struct ColumnPair {
  std::uint8_t a, b;
};

class Signatures {
 public:
  static constexpr std::size_t kSlots = StartGrid::kSlots;

  /// `trackers`: with more than one, calibration shifts of each are columns of their own.
  explicit Signatures(std::uint32_t trackers);

  /// Shift columns of a tracker: x, y, turn.
  [[nodiscard]] std::size_t shift_column(std::uint32_t tracker) const {
    return trackers_ > 1 ? kColumns + 3 * std::size_t{tracker} : std::size_t{kShiftX};
  }
  [[nodiscard]] std::size_t columns() const { return columns_; }

  /// Everything as if no effect had begun.
  void clear();
  /// The effects of a slot begin now.
  void clear(Family family, std::size_t slot);
  /// The filter forgot its pose: shifts that had begun are absorbed. Sums stay.
  void forget_pose();

  void predict(const Transition& step);
  /// `x_mm`, `y_mm`: the predicted position. `counts`: the sums take the innovation.
  void correct(const Innovation& innovation, std::uint32_t tracker, double x_mm, double y_mm, bool counts);

  [[nodiscard]] double score(std::size_t column, std::size_t slot) const { return score_[column][slot]; }
  /// Columns of one group.
  [[nodiscard]] double information(std::size_t a, std::size_t b, std::size_t slot) const {
    return information_[pair_of_[a * columns_ + b]][slot];
  }

 private:
  using Row = std::array<double, kSlots>;

  const std::uint32_t trackers_;
  const std::size_t columns_;
  std::vector<ColumnPair> pairs_;
  std::vector<std::size_t> pair_of_;       ///< by a * columns + b
  std::vector<std::array<Row, 5>> error_;  ///< per column: error of the state by the effect
  std::vector<Row> score_, information_;
  std::vector<std::array<Row, 3>> shift_;  ///< per column: of the white innovation; scratch of correct()
};

/// The same for one hypothesis with one start: a gain of both wheels while a robot crosses a place.
class PlaceSignature {
 public:
  void clear() { *this = {}; }
  void predict(const Transition& step);
  void correct(const Innovation& innovation, bool counts);
  [[nodiscard]] double score() const { return score_; }
  [[nodiscard]] double information() const { return information_; }

 private:
  std::array<double, 5> error_{};
  double score_ = 0, information_ = 0;
};

}  // namespace kilotwin::monitor
