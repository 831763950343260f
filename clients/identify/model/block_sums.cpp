#include "clients/identify/model/block_sums.hpp"

#include <algorithm>

namespace kilotwin::identify {

BlockSums::BlockSums(const MotionModel& model)
    : layout_(std::make_shared<const Layout>(layout_of(model))),
      values_(layout_->values),
      instants_(layout_->states, 0) {}

BlockSums::Layout BlockSums::layout_of(const MotionModel& model) {
  Layout layout;
  const auto index_of = [&](const Factor& factor) {
    const auto known = std::find_if(layout.factors.begin(), layout.factors.end(),
                                    [&](const OfFactor& one) { return *one.factor == factor; });
    if (known != layout.factors.end()) return static_cast<std::size_t>(known - layout.factors.begin());
    const bool is_table = factor.shape == Factor::Shape::kTable && factor.known.empty();
    OfFactor& one = layout.factors.emplace_back(OfFactor{&factor, factor.size(), {}, {}, is_table});
    const std::size_t wheels = Basis{{factor}}.per_wheel() ? 2 : 1;
    for (std::size_t wheel = 0; wheel < 2; ++wheel) {
      one.first[wheel] = wheel < wheels ? layout.values : one.first[0];
      one.state[wheel] = wheel < wheels ? layout.states : one.state[0];
      if (wheel >= wheels) continue;
      layout.values += is_table ? 1 : one.size;
      ++layout.states;
    }
    return layout.factors.size() - 1;
  };
  for (const Term& term : model.terms) {
    const double* coefficients = term.coefficients.data();
    for (const Block& block : term.blocks) {
      const double* const own = coefficients;
      const std::size_t n = block.basis.size();
      coefficients += n;
      if (is_measured(block.target)) continue;
      OfBlock& one = layout.blocks.emplace_back(OfBlock{&block, {}, {}, own, {}, block.basis.per_wheel()});
      for (const Factor& factor : block.basis.factors) one.factors.push_back(index_of(factor));
      std::size_t products = 1;
      one.strides.resize(one.factors.size());
      for (std::size_t f = one.factors.size(); f-- > 0;) {
        one.strides[f] = products;
        products *= layout.factors[one.factors[f]].size;
      }
      if (block.basis.chosen.empty()) continue;
      one.all_products.assign(products, 0);
      for (std::size_t i = 0; i < n; ++i) one.all_products[block.basis.chosen[i]] = own[i];
    }
  }
  // Only now: the vectors of the blocks moved while there came more.
  for (OfBlock& one : layout.blocks)
    if (!one.all_products.empty()) one.coefficients = one.all_products.data();
  return layout;
}

std::size_t BlockSums::evaluated(const OfFactor& one, const Situation& s, std::size_t wheel) {
  const std::size_t at = one.first[wheel];
  if (std::uint64_t& seen = instants_[one.state[wheel]]; seen != instant_) {
    seen = instant_;
    if (one.is_table) {
      const std::vector<double>& keys = one.factor->points;
      values_[at] = static_cast<double>(std::find(keys.begin(), keys.end(), value_of(one.factor->axis, s, wheel)) -
                                        keys.begin());
    } else {
      one.factor->evaluate(s, wheel, values_.data() + at);
    }
  }
  return at;
}

bool BlockSums::lacks_key(const OfBlock& block, const Situation& s) {
  return std::any_of(block.factors.begin(), block.factors.end(), [&](std::size_t f) {
    const OfFactor& one = layout_->factors[f];
    return one.is_table && values_[evaluated(one, s, 0)] == static_cast<double>(one.size);
  });
}

double BlockSums::of_block(const OfBlock& block, const Situation& s, std::size_t wheel) {
  for (const std::size_t f : block.factors) (void)evaluated(layout_->factors[f], s, wheel);
  return part(block, 0, block.coefficients, wheel);
}

double BlockSums::part(const OfBlock& block, std::size_t f, const double* coefficients, std::size_t wheel) const {
  if (f == block.factors.size()) return coefficients[0];
  const OfFactor& one = layout_->factors[block.factors[f]];
  const double* const values = values_.data() + one.first[wheel];
  const std::size_t stride = block.strides[f];
  if (one.is_table) return part(block, f + 1, coefficients + static_cast<std::size_t>(values[0]) * stride, wheel);
  if (f + 1 == block.factors.size()) {
    const auto n = static_cast<Eigen::Index>(one.size);
    return Eigen::Map<const Eigen::VectorXd>(values, n).dot(Eigen::Map<const Eigen::VectorXd>(coefficients, n));
  }
  double all = 0;
  for (std::size_t i = 0; i < one.size; ++i)
    if (values[i] != 0) all += values[i] * part(block, f + 1, coefficients + i * stride, wheel);
  return all;
}

}  // namespace kilotwin::identify
