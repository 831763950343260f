/// The effects on the motion in one situation, block by block, as the filters need them at every step of every robot.
#pragma once

#include <memory>
#include <vector>

#include "clients/identify/model/motion_model.hpp"

namespace kilotwin::identify {

/// The weighted sums of the columns of the blocks that act on the motion. Factors that stand in several blocks are evaluated once per
/// situation, and no product of columns is written out: a sum over two factors is a bilinear form. Copies share what does not change.
class BlockSums {
 public:
  /// The model must outlive the sums, with its terms as they are now.
  explicit BlockSums(const MotionModel& model);

  /// Calls take(block, left, right) for the blocks that act under the present command, with their sums at the two wheels. Blocks whose
  /// columns are all 0 are left out.
  template <class Take> void for_each(const Situation& s, Take&& take) {
    if (layout_->blocks.empty()) return;
    ++instant_;
    for (const OfBlock& one : layout_->blocks) {
      if ((one.block->during >> static_cast<int>(s.commands.command) & 1) == 0 || lacks_key(one, s)) continue;
      const double left = of_block(one, s, 0);
      take(*one.block, left, one.per_wheel ? of_block(one, s, 1) : left);
    }
  }

 private:
  /// A factor that one or more blocks hold.
  struct OfFactor {
    const Factor* factor;
    std::size_t size;  ///< number of columns
    std::size_t
        first[2];  ///< place of the values at the left and the right wheel; of tables: of the index of the key
    std::size_t state[2];  ///< index into instants_
    bool is_table;         ///< of unknown values, one of which is 1
  };
  struct OfBlock {
    const Block* block;
    std::vector<std::size_t> factors;  ///< indices into Layout::factors
    std::vector<std::size_t> strides;  ///< number of coefficients per column of each factor
    const double* coefficients;        ///< of all products
    std::vector<double> all_products;  ///< the coefficients, if the basis uses some products only
    bool per_wheel;
  };
  struct Layout {
    std::vector<OfFactor> factors;
    std::vector<OfBlock> blocks;
    std::size_t values = 0, states = 0;
  };
  static Layout layout_of(const MotionModel&);

  /// The place of the factor's values at a wheel, evaluated if they are not there yet.
  std::size_t evaluated(const OfFactor&, const Situation&, std::size_t wheel);
  [[nodiscard]] bool lacks_key(const OfBlock&, const Situation&);
  [[nodiscard]] double of_block(const OfBlock&, const Situation&, std::size_t wheel);
  /// The sum over the columns of the block's factors from `f` on.
  [[nodiscard]] double part(const OfBlock&, std::size_t f, const double* coefficients, std::size_t wheel) const;

  std::shared_ptr<const Layout> layout_;
  std::vector<double> values_;
  std::vector<std::uint64_t> instants_;  ///< for which the values of each factor and wheel are there
  std::uint64_t instant_ = 0;
};

}  // namespace kilotwin::identify
