#include "clients/identify/search/central_distortion.hpp"

#include <algorithm>
#include <utility>

#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

/// Order of the polynomials of the scale: a lens needs its radius to the fourth power, and a centre beside the origin more.
constexpr std::uint32_t kScaleOrder = 6;
/// Order of the map for the rest: an affine map, and the shift by a centre beside the origin.
constexpr std::uint32_t kRestOrder = 3;

/// The polynomials of a free map of the measured position along x and y; null: the term is another one.
const Factor* free_map(const Term& term) {
  const Factor* map = nullptr;
  for (const Block& block : term.blocks) {
    const bool positions = block.target == Target::kMeasuredX || block.target == Target::kMeasuredY;
    if (!positions || block.basis.factors.size() != 1 ||
        block.basis.factors.front().shape != Factor::Shape::kPolynomials2)
      return nullptr;
    map = &block.basis.factors.front();
  }
  return map;
}

}  // namespace

void fit_central_distortion(const Fitter& fitter, FitState& state, std::size_t place) {
  const Factor* const map = free_map(state.model.terms[place]);
  if (map == nullptr) return;
  Factor rest = *map, scale = *map;
  rest.count = kRestOrder;
  scale.count = kScaleOrder;
  FitState trial = state;
  refine_to(fitter, trial, place,
            {{Target::kMeasuredX, Basis{{rest}}, kAlways},
             {Target::kMeasuredY, Basis{{rest}}, kAlways},
             {Target::kMeasuredScale, Basis{{scale}}, kAlways}});
  if (fitter.log_evidence(trial) > fitter.log_evidence(state)) state = std::move(trial);
}

}  // namespace kilotwin::identify
