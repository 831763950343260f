/// Products over run time or over motor-on time.
#include <algorithm>
#include <array>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/target_extension.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Nat by which the other clock must be better. Time is the simpler one: unless the data tell them apart, it stays or is taken.
constexpr double kForMotorTime = 6, kForTime = 0;
/// Cosines in which both are compared. A step shows best in the clock that it belongs to, whatever their number.
constexpr std::uint32_t kClockCosines = 16;

bool is_clock(const Factor& f) {
  return f.axis == Axis{Covariate::kTime} || f.axis == Axis{Covariate::kMotorTimeSum};
}

/// Log evidence of each block in place of a term. A block has one open factor.
std::array<double, 2> evidence_of(const Fitter& fitter, const FitState& state, std::size_t place,
                                  const std::array<Block, 2>& blocks) {
  const LocalQuadratic l = local_quadratic(fitter, state, place, {blocks.begin(), blocks.end()});
  const Eigen::VectorXd score = l.score_without(state.model.terms[place].coefficients);
  std::array<double, 2> out{};
  Eigen::Index next = l.own;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    ColumnGroup group;
    group.roughness = blocks[b].basis.roughness();
    std::vector<Eigen::Index> columns;
    for (std::size_t i = 0; i < group.roughness.size(); ++i) {
      group.columns.push_back(static_cast<Eigen::Index>(i));
      columns.push_back(next++);
    }
    const ReducedColumns data = reduced_columns(l, score, columns);
    std::vector<Smoothness> smoothness;
    Eigen::VectorXd sd;
    out[b] = choose_smoothness(data.information, data.score, {group}, smoothness, sd);
  }
  return out;
}

/// Fits a product in place of a term. The evidence of the whole model.
double fitted(const Fitter& fitter, FitState& state, std::size_t place, std::vector<Factor> functions) {
  ProductFit product(fitter, state, place, std::move(functions));
  product.fit();
  fitter.fit_until_settled(state);
  return fitter.log_evidence(state) - product.cost_of_known();
}

}  // namespace

bool exchange_clock(const Fitter& fitter, FitState& state, std::size_t place) {
  const Term part = main_part(state.model.terms[place]);
  const std::vector<Factor> functions = functions_of(part);
  const auto clock = std::find_if(functions.begin(), functions.end(), is_clock);
  if (functions.size() < 2 || clock == functions.end()) return false;
  const Extent extent = extent_of(state.tracks);
  std::array<Factor, 2> clocks{over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, kClockCosines),
                               over(Shape::kCosines, Covariate::kMotorTimeSum, 0, extent.sum_s, kClockCosines)};
  const std::size_t has = clock->axis.of == Covariate::kTime ? 0 : 1, other = 1 - has;
  std::array<Block, 2> blocks;
  for (std::size_t c = 0; c < clocks.size(); ++c) {
    Basis basis{functions};
    basis.factors.erase(basis.factors.begin() + (clock - functions.begin()));
    basis.factors.push_back(clocks[c]);
    basis.factors.back().first = 0;
    blocks[c] = {part.blocks.front().target, basis, part.blocks.front().during};
  }
  const std::array<double, 2> evidence = evidence_of(fitter, state, place, blocks);
  const double least = other == 1 ? kForMotorTime : kForTime;
  if (!(evidence[other] > evidence[has] + least)) return false;
  std::vector<Factor> exchanged = functions;
  Factor& start = exchanged[static_cast<std::size_t>(clock - functions.begin())];
  start = clocks[other];
  start.known.assign(start.columns(), 0);
  start.plus = 1;
  FitState trial = state, same = state;
  // Negated, so that an evidence that is no number does not count.
  if (!(fitted(fitter, trial, place, exchanged) > fitted(fitter, same, place, functions) + least)) return false;
  extend_targets(fitter, trial, place);
  state = std::move(trial);
  return true;
}

}  // namespace kilotwin::identify
