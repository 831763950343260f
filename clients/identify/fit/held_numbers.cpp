#include "clients/identify/fit/held_numbers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// A block of the model with its coefficients.
struct OwnBlock {
  std::size_t index;  ///< among all blocks of the model
  const Block* block;
  Eigen::VectorXd coefficients;
};

std::vector<OwnBlock> own_blocks(const Term& term, std::size_t first_index) {
  std::vector<OwnBlock> all;
  Eigen::Index first = 0;
  for (const Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    all.push_back({first_index + all.size(), &block, term.coefficients.segment(first, n)});
    first += n;
  }
  return all;
}

/// The coefficients of all products of a basis, those that are not in use with 0.
Eigen::VectorXd of_all_products(const Basis& basis, const Eigen::VectorXd& coefficients) {
  if (basis.chosen.empty()) return coefficients;
  Eigen::Index products = 1;
  for (const Factor& f : basis.factors) products *= static_cast<Eigen::Index>(f.size());
  Eigen::VectorXd all = Eigen::VectorXd::Zero(products);
  for (std::size_t i = 0; i < basis.chosen.size(); ++i)
    all[basis.chosen[i]] = coefficients[static_cast<Eigen::Index>(i)];
  return all;
}

bool is_map_of_nodes(const Factor& f) { return f.shape == Shape::kGrid; }

/// A known factor whose coefficients have an uncertainty of their own. One column has a scale only, which is held.
bool has_open_coefficients(const Factor& f) {
  return !f.known.empty() && !is_map_of_nodes(f) && f.columns() <= kMostColumns && (f.columns() > 1 || f.plus != 0);
}

/// Coefficients that scale the whole function, with its constant; empty if no coefficients do.
Eigen::VectorXd scale_of(const Factor& f) {
  Eigen::VectorXd all =
      Eigen::Map<const Eigen::VectorXd>(f.known.data(), static_cast<Eigen::Index>(f.known.size()));
  if (f.plus == 0) return all;
  if (f.shape == Shape::kTable) return (all.array() + f.plus).matrix();
  const bool has_constant =
      f.first == 0 && (f.shape == Shape::kCosines || f.shape == Shape::kCosines2 || f.shape == Shape::kHarmonics);
  if (!has_constant) return {};
  all[0] += f.plus;
  return all;
}

/// Prior precisions of a known factor's coefficients: their own spread, smaller for rougher columns, and the scale held.
Eigen::MatrixXd prior_of(const Factor& f) {
  // kHeld: standard deviation of the scale, relative. A larger one would count the uncertainty of the open function
  // twice. kLeast: variance of a function that is 0 everywhere, which keeps the precision finite.
  constexpr double kHeld = 1e-3, kLeast = 1e-6;
  Factor open = f;
  open.known.clear();
  const std::vector<double> rough = open.roughness();
  const auto n = static_cast<Eigen::Index>(f.known.size());
  double square = 0;
  for (std::size_t i = 0; i < f.known.size(); ++i) square += std::pow(f.known[i] * rough[i], 2);
  const double variance = std::max(square / static_cast<double>(n), kLeast);
  Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) precision(i, i) = std::pow(rough[static_cast<std::size_t>(i)], 2) / variance;
  if (const Eigen::VectorXd scale = scale_of(f); scale.size() > 0 && scale.squaredNorm() > 0) {
    const Eigen::VectorXd row = scale / (scale.squaredNorm() * kHeld);
    precision += row * row.transpose();
  }
  return precision;
}

/// A number of some factors of a term, and how to move it.
struct MovableNumber {
  std::string name, unit;
  double value, step;
  std::function<bool(const Factor&)> is_in;
  std::function<void(Factor&, double)> move;
  HeldNumber::Kind kind = HeldNumber::Kind::kOther;
};

void add_centre(std::vector<MovableNumber>& to, const Factor& f, const DataExtent& extent) {
  const MovingPoint point = f.axis.point;
  const auto add = [&](const char* name, const char* unit, double MovingPoint::*number, double step) {
    to.push_back({name, unit, point.*number, step,
                  [point](const Factor& other) {
                    return other.axis.of == Covariate::kPointDistance && other.axis.point == point;
                  },
                  [number](Factor& moved, double by) { moved.axis.point.*number += by; }});
  };
  // Far below the widths of curves, and far above rounding. Velocity and growth move the circle by as much in a run.
  constexpr double kStep_mm = 1;
  add("centre x", "mm", &MovingPoint::x_mm, kStep_mm);
  add("centre y", "mm", &MovingPoint::y_mm, kStep_mm);
  // The fit sets these to exactly 0 where the data do not tell them from it.
  if (point.velocity_x_mm_s != 0 || point.velocity_y_mm_s != 0) {
    add("velocity x", "mm/s", &MovingPoint::velocity_x_mm_s, kStep_mm / extent.duration_s);
    add("velocity y", "mm/s", &MovingPoint::velocity_y_mm_s, kStep_mm / extent.duration_s);
  }
  if (point.growth_mm_s != 0) add("growth", "mm/s", &MovingPoint::growth_mm_s, kStep_mm / extent.duration_s);
}

void add_direction(std::vector<MovableNumber>& to, const Factor& f, const DataExtent& extent) {
  const double along_rad = f.axis.along_rad;
  constexpr double kStep_mm = 1;  // at the border of the data, as for a centre
  to.push_back({"direction", "rad", along_rad, kStep_mm / extent.half_side_mm,
                [along_rad](const Factor& other) {
                  return other.axis.of == Covariate::kAlong && other.axis.along_rad == along_rad;
                },
                [](Factor& moved, double by) { moved.axis.along_rad += by; }});
}

void add_wave(std::vector<MovableNumber>& to, const Factor& f, const DataExtent& extent) {
  const std::vector<double> points = f.points;
  // Change of the phase at the border of the data, or in a run. The error of the derivative is its square over 6, some
  // 0.01 %.
  constexpr double kStep_rad = 0.02;
  using Kind = HeldNumber::Kind;
  const double step_mm = kStep_rad / extent.half_side_mm, step_s = kStep_rad / extent.duration_s;
  const std::array<MovableNumber, 3> all = {
      {{"wave number x", "rad/mm", points[0], step_mm, {}, {}, Kind::kWaveNumberX},
       {"wave number y", "rad/mm", points[1], step_mm, {}, {}, Kind::kWaveNumberY},
       {"angular frequency", "rad/s", points[2], step_s, {}, {}, Kind::kAngularFrequency}}};
  for (std::size_t d = 0; d < all.size(); ++d) {
    if (d == 2 && points[d] == 0) continue;  // a pattern that stands still
    MovableNumber& number = to.emplace_back(all[d]);
    number.is_in = [points](const Factor& other) {
      return other.shape == Shape::kTravelling && other.points == points;
    };
    number.move = [d](Factor& moved, double by) { moved.points[d] += by; };
  }
}

void add_scale(std::vector<MovableNumber>& to, const Factor& f, const char* name) {
  constexpr double kShare = 0.01;  // of the number; an error of the derivative of some 0.01 %
  const double value = f.points[0];
  to.push_back({name, unit_of(f.axis.of), value, kShare * std::abs(value),
                [shape = f.shape, axis = f.axis, value](const Factor& other) {
                  return other.shape == shape && other.axis == axis && other.points.size() == 1 &&
                         other.points[0] == value;
                },
                [](Factor& moved, double by) { moved.points[0] += by; }});
}

/// The numbers of a term's factors, each once.
std::vector<MovableNumber> movable_numbers(const Term& term, const DataExtent& extent) {
  std::vector<MovableNumber> all;
  for (const Block& block : term.blocks) {
    for (const Factor& f : block.basis.factors) {
      if (std::any_of(all.begin(), all.end(), [&](const MovableNumber& n) { return n.is_in(f); })) continue;
      if (f.axis.of == Covariate::kPointDistance) add_centre(all, f, extent);
      if (f.axis.of == Covariate::kAlong) add_direction(all, f, extent);
      if (f.shape == Shape::kTravelling) add_wave(all, f, extent);
      const bool one = f.points.size() == 1;
      if (one && (f.shape == Shape::kExponential || f.shape == Shape::kLevelling)) add_scale(all, f, "decay");
      if (one && f.shape == Shape::kWave) add_scale(all, f, "period");
    }
  }
  return all;
}

/// A factor of value 1 at one node of a coarse raster over a map, linear between the nodes.
Factor node_of(const Factor& map, std::uint32_t node) {
  Factor f = map;
  f.count = kDeviationNodes;
  f.points.assign(std::size_t{kDeviationNodes} * kDeviationNodes, 0);
  f.points[node] = 1;
  f.known = {1};
  f.plus = 0;
  return f;
}

/// Builds the numbers of one term after another.
class Collector {
 public:
  explicit Collector(HeldNumbers& to) : to_(to) {}

  void add_term(const Term& term, std::size_t t, std::size_t first_block, const DataExtent& extent) {
    const std::vector<OwnBlock> own = own_blocks(term, first_block);
    std::vector<std::pair<Factor, Eigen::Index>> seen;  // functions that several blocks share
    for (const OwnBlock& one : own) {
      for (std::size_t f = 0; f < one.block->basis.factors.size(); ++f) {
        const Factor& factor = one.block->basis.factors[f];
        const bool nodes = is_map_of_nodes(factor);
        if (!nodes && !has_open_coefficients(factor)) continue;
        auto at = std::find_if(seen.begin(), seen.end(), [&](const auto& s) { return s.first == factor; });
        if (at == seen.end()) {
          seen.emplace_back(factor, to_.size());
          at = seen.end() - 1;
          add_function(t, factor);
        }
        if (nodes) {
          add_nodes(one, f, at->second);
        } else {
          for (WeighedBlock& part : value_as_blocks(*one.block, one.coefficients, static_cast<int>(f)))
            to_.columns.add(std::move(part.block), one.index, at->second, part.weight);
        }
      }
    }
    for (const MovableNumber& number : movable_numbers(term, extent)) add_number(t, own, number);
  }
  void finish() {
    to_.columns.finish(to_.size());
    to_.precision = Eigen::MatrixXd::Zero(to_.size(), to_.size());
    for (const auto& [first, precision] : priors_)
      to_.precision.block(first, first, precision.rows(), precision.cols()) = precision;
  }

 private:
  void add_function(std::size_t t, const Factor& f) {
    constexpr double kLeast = 1e-6;  // variance of a flat map, which keeps the precision finite
    Eigen::MatrixXd prior;
    if (is_map_of_nodes(f)) {
      constexpr auto n = Eigen::Index{kDeviationNodes} * kDeviationNodes;
      const Eigen::Map<const Eigen::ArrayXd> values(f.points.data(), static_cast<Eigen::Index>(f.points.size()));
      const double scale = f.known.empty() ? 1 : f.known[0];
      const double variance = std::max(scale * scale * (values - values.mean()).square().mean(), kLeast);
      prior = Eigen::MatrixXd::Identity(n, n) / variance;
    } else {
      prior = prior_of(f);
    }
    priors_.emplace_back(to_.size(), prior);
    for (Eigen::Index i = 0; i < prior.rows(); ++i) {
      HeldNumber& number = to_.numbers.emplace_back(HeldNumber{t, ""});
      if (f.shape != Shape::kTable) continue;
      const auto key = static_cast<std::size_t>(i);
      number.name =
          std::string("amplitude, ") + name_of(f.axis.of) + " " + std::to_string(static_cast<int>(f.points[key]));
      number.value = f.plus + f.known[key];
      number.kind = HeldNumber::Kind::kAmplitude;
    }
  }
  void add_nodes(const OwnBlock& one, std::size_t f, Eigen::Index first) {
    for (std::uint32_t node = 0; node < kDeviationNodes * kDeviationNodes; ++node) {
      Block block = *one.block;
      block.basis.factors[f] = node_of(one.block->basis.factors[f], node);
      // An open map has one coefficient, which is that of its nodes, too.
      for (WeighedBlock& part : value_as_blocks(block, one.coefficients))
        to_.columns.add(std::move(part.block), one.index, first + node, part.weight);
    }
  }
  void add_number(std::size_t t, const std::vector<OwnBlock>& own, const MovableNumber& number) {
    const Eigen::Index at = to_.size();
    for (const OwnBlock& one : own) {
      for (const double sign : {1.0, -1.0}) {
        Block moved = *one.block;
        bool any = false;
        for (Factor& f : moved.basis.factors) {
          if (!number.is_in(f)) continue;
          number.move(f, sign * number.step);
          any = true;
        }
        if (!any) continue;
        for (WeighedBlock& part : value_as_blocks(moved, one.coefficients))
          to_.columns.add(std::move(part.block), one.index, at, part.weight * sign / (2 * number.step));
      }
    }
    // Steps: 10 m, 200 rad of phase or 100 times a decay time, beyond all that data tell. Closer, the prior would
    // narrow intervals.
    constexpr double kFarthest = 1e4;
    const double farthest = kFarthest * number.step;
    to_.numbers.push_back({t, number.name, number.unit, number.value, farthest, number.kind});
    priors_.emplace_back(at, Eigen::MatrixXd::Constant(1, 1, 1 / (farthest * farthest)));
  }

  HeldNumbers& to_;
  std::vector<std::pair<Eigen::Index, Eigen::MatrixXd>> priors_;
};

}  // namespace

void ColumnSums::add(Block block, std::size_t of, Eigen::Index first, double weight) {
  blocks.push_back(std::move(block));
  of_block.push_back(of);
  parts_.push_back({first, weight});
}

void ColumnSums::finish(Eigen::Index sums) {
  Eigen::Index columns = 0;
  for (const Block& block : blocks) columns += static_cast<Eigen::Index>(block.basis.size());
  weights = Eigen::MatrixXd::Zero(columns, sums);
  Eigen::Index column = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(blocks[b].basis.size()); ++i)
      weights(column++, parts_[b].first + i) += parts_[b].weight;
}

std::vector<WeighedBlock> value_as_blocks(const Block& block, const Eigen::VectorXd& coefficients, int open) {
  // Products with more parts get no columns: each part is a block of the linearisation, which this bounds.
  constexpr Eigen::Index kMostBlocks = 64;
  const std::vector<Factor>& factors = block.basis.factors;
  const Eigen::VectorXd all = of_all_products(block.basis, coefficients);
  int last = -1;  // the last open factor
  for (std::size_t f = 0; f < factors.size(); ++f)
    if (factors[f].known.empty()) last = static_cast<int>(f);
  const auto own =
      last < 0 ? Eigen::Index{1} : static_cast<Eigen::Index>(factors[static_cast<std::size_t>(last)].size());
  if (factors.empty() || all.size() / own > kMostBlocks) return {};
  std::vector<WeighedBlock> parts;
  // Known factors have one column, so the index of a product is that of the open ones alone; the last one runs fastest.
  for (Eigen::Index outer = 0; outer < all.size() / own; ++outer) {
    const Eigen::VectorXd slice = all.segment(outer * own, own);
    if (slice.isZero(0)) continue;
    Basis basis{factors};
    Eigen::Index rest = outer;
    for (int f = static_cast<int>(factors.size()) - 1; f >= 0; --f) {
      Factor& factor = basis.factors[static_cast<std::size_t>(f)];
      if (f == open) {
        factor.known.clear();
        factor.plus = 0;
      } else if (f == last) {
        factor.known.assign(slice.begin(), slice.end());
      } else if (factor.known.empty()) {
        const auto n = static_cast<Eigen::Index>(factor.size());
        factor.known.assign(factor.columns(), 0);
        factor.known[static_cast<std::size_t>(rest % n)] = 1;
        rest /= n;
      }
    }
    parts.push_back({{block.target, std::move(basis), block.during}, last < 0 ? all[0] : 1});
  }
  return parts;
}

HeldNumbers held_numbers_of(const MotionModel& model, const DataExtent& extent) {
  HeldNumbers out;
  Collector collect(out);
  std::size_t block = 0;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    collect.add_term(model.terms[t], t, block, extent);
    block += model.terms[t].blocks.size();
  }
  collect.finish();
  return out;
}

}  // namespace kilotwin::identify
