/// Numbers of a model that the fit of its coefficients holds: the coefficients of known functions in products, the nodes of maps with
/// fixed values, the centre of moving circles, wave numbers, decay times. The derivatives of the effects by them are further columns of
/// a linearisation, so that their uncertainty enters that of all other parameters.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

/// Columns that are sums of columns of blocks with weights.
struct ColumnSums {
  std::vector<Block> blocks;
  std::vector<std::size_t> of_block;  ///< by block: index among all blocks of the model whose value it changes
  Eigen::MatrixXd weights;            ///< columns of the blocks x sums

  /// Adds `weight` times the columns of a block to the sums from `first` on, one sum per column.
  void add(Block, std::size_t of, Eigen::Index first, double weight);
  /// Makes `weights` from what was added.
  void finish(Eigen::Index sums);

 private:
  struct Part {
    Eigen::Index first;
    double weight;
  };
  std::vector<Part> parts_;  ///< by block
};

struct HeldNumber {
  enum class Kind : std::uint8_t { kOther, kAmplitude, kWaveNumberX, kWaveNumberY, kAngularFrequency };
  std::size_t term = 0;
  std::string name;  ///< of numbers that are reported; empty: a coefficient or a node
  std::string unit = {};
  double value = 0;
  double farthest =
      0;  ///< standard deviation of its prior, which only keeps the variance finite; 0: the prior has a meaning
  Kind kind = Kind::kOther;

  /// Whether the data leave it open: its standard deviation is that of the prior.
  [[nodiscard]] bool is_open(double sd) const { return farthest > 0 && sd > farthest / 2; }
};

/// Nodes along each axis of the deviation from a map with fixed values: its values are known as means over about one cell.
inline constexpr std::uint32_t kDeviationNodes = 9;

/// Extent of the data, by which the steps of numerical derivatives are chosen.
struct DataExtent {
  double duration_s = 1, half_side_mm = 1;
};

struct HeldNumbers {
  std::vector<HeldNumber> numbers;  ///< those of a term are neighbours
  ColumnSums columns;               ///< derivatives of the effects: one sum per number
  /// Prior precision. Known functions: the spread of their coefficients. Their scale is held, because it is that of the open
  /// function beside them.
  Eigen::MatrixXd precision;

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(numbers.size()); }
};

[[nodiscard]] HeldNumbers held_numbers_of(const MotionModel&, const DataExtent&);

/// A block of one column, or of those of one known factor that is open in it, times a weight.
struct WeighedBlock {
  Block block;
  double weight;
};
/// Blocks whose weighted sum is the value of a block with these coefficients. `open`: index of a known factor whose coefficients stay
/// open; below 0: none. Empty for constants, and for bases with too many columns.
[[nodiscard]] std::vector<WeighedBlock> value_as_blocks(const Block&, const Eigen::VectorXd& coefficients,
                                                        int open = -1);

}  // namespace kilotwin::identify
