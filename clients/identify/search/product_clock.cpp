/// Products over run time or over motor-on time.
#include <algorithm>
#include <array>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/products.hpp"
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

}  // namespace

bool exchange_clock(const Fitter& fitter, FitState& state, std::size_t place) {
  const Term part = main_part(state.model.terms[place]);
  const std::vector<Factor> functions = functions_of(part);
  const auto clock = std::find_if(functions.begin(), functions.end(), is_clock);
  if (functions.size() < 2 || std::count_if(functions.begin(), functions.end(), is_clock) != 1) return false;
  const Extent extent = extent_of(state.tracks);
  std::array<Factor, 2> clocks{over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, kClockCosines),
                               over(Shape::kCosines, Covariate::kMotorTimeSum, 0, extent.sum_s, kClockCosines)};
  const std::size_t has = clock->axis.of == Covariate::kTime ? 0 : 1, other = 1 - has;
  std::vector<std::vector<Block>> forms;
  for (const Factor& one : clocks) {
    Basis basis{functions};
    basis.factors.erase(basis.factors.begin() + (clock - functions.begin()));
    basis.factors.push_back(one);
    basis.factors.back().first = 0;
    forms.push_back({{part.blocks.front().target, basis, part.blocks.front().during}});
  }
  const std::vector<double> evidence = evidence_of_forms(fitter, state, place, forms);
  const double least = other == 1 ? kForMotorTime : kForTime;
  if (!(evidence[other] > evidence[has] + least)) return false;
  std::vector<Factor> exchanged = functions;
  Factor& start = exchanged[static_cast<std::size_t>(clock - functions.begin())];
  start = clocks[other];
  start.known.assign(start.columns(), 0);
  start.plus = 1;
  FitState trial = state, same = state;
  // Negated, so that an evidence that is no number does not count.
  if (!(fit_product(fitter, trial, place, exchanged) > fit_product(fitter, same, place, functions) + least))
    return false;
  extend_targets(fitter, trial, place);
  state = std::move(trial);
  return true;
}

}  // namespace kilotwin::identify
