#include "clients/identify/search/central_distortion.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <utility>
#include <vector>

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

/// Places at which robots were seen, at most some thousand.
std::vector<Eigen::Vector2d> places_of(const FitState& state) {
  // Places of the fit to a free map; more cost time in proportion and follow the map closer.
  constexpr std::size_t kMostPlaces = 4000;
  std::size_t samples = 0, n = 0;
  for (const auto& unit : state.tracks.units())
    for (const TrackView* view : unit) samples += view->track->samples.size();
  std::vector<Eigen::Vector2d> places;
  for (const auto& unit : state.tracks.units())
    for (const TrackView* view : unit)
      for (const Sample& sample : view->track->samples)
        if (n++ % (samples / kMostPlaces + 1) == 0) places.emplace_back(sample.x_mm, sample.y_mm);
  return places;
}

/// A term with the blocks of a map along x and y and of a scale, nearest to a free map at the places, with a weak prior. Fits
/// from there converge; from a scale of one they may not.
Term nearest_to(const Term& free, const Factor& rest, const Factor& scale,
                const std::vector<Eigen::Vector2d>& places) {
  // Standard deviations: of a place of the free map, and of the priors of shifts and scales. The first is far below the
  // others, so that the map decides; smaller priors would pull the term towards none.
  constexpr double kPosition_mm = 0.1, kRest_mm = 10, kScale = 0.2;
  Term near = free;
  near.blocks = {{Target::kMeasuredX, Basis{{rest}}, kAlways},
                 {Target::kMeasuredY, Basis{{rest}}, kAlways},
                 {Target::kMeasuredScale, Basis{{scale}}, kAlways}};
  const auto of_rest = static_cast<Eigen::Index>(rest.size()), of_scale = static_cast<Eigen::Index>(scale.size());
  near.precision = Eigen::VectorXd::Constant(2 * of_rest + of_scale, 1 / (kRest_mm * kRest_mm));
  near.precision.tail(of_scale).setConstant(1 / (kScale * kScale));
  Eigen::MatrixXd information = (kPosition_mm * kPosition_mm * near.precision).asDiagonal();
  Eigen::VectorXd score = Eigen::VectorXd::Zero(near.precision.size());
  std::array<double, kMostColumns> values{};
  for (const Eigen::Vector2d& place : places) {
    Situation at;
    at.x_mm = place[0];
    at.y_mm = place[1];
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();
    Eigen::Index first = 0;
    for (const Block& block : free.blocks) {
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      block.basis.evaluate(at, 0, values.data());
      shift[block.target == Target::kMeasuredX ? 0 : 1] +=
          free.coefficients.segment(first, n).dot(Eigen::Map<const Eigen::VectorXd>(values.data(), n));
      first += n;
    }
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, near.precision.size());
    near.blocks.front().basis.evaluate(at, 0, values.data());
    rows.row(0).head(of_rest) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), of_rest);
    rows.row(1).segment(of_rest, of_rest) = rows.row(0).head(of_rest);
    near.blocks.back().basis.evaluate(at, 0, values.data());
    rows.rightCols(of_scale) = place * Eigen::Map<const Eigen::RowVectorXd>(values.data(), of_scale);
    information.noalias() += rows.transpose() * rows;
    score.noalias() += rows.transpose() * shift;
  }
  near.coefficients = information.ldlt().solve(score);
  return near;
}

}  // namespace

void fit_central_distortion(const Fitter& fitter, FitState& state, std::size_t place) {
  const Factor* const map = free_map(state.model.terms[place]);
  if (map == nullptr) return;
  Factor rest = *map, scale = *map;
  rest.count = kRestOrder;
  scale.count = kScaleOrder;
  // Two beginnings, because the fit may end in a side optimum: the form from nothing, and from the free map.
  const Term near = nearest_to(state.model.terms[place], rest, scale, places_of(state));
  const FitState free = state;
  double most = fitter.log_evidence(state);
  for (const bool from_nothing : {true, false}) {
    FitState trial = free;
    if (!from_nothing) {
      trial.model.terms[place] = near;
      fitter.fit(trial, 1);
    }
    refine_to(fitter, trial, place, near.blocks);
    if (!from_nothing) fitter.fit(trial, 3);
    const double evidence = fitter.log_evidence(trial);
    if (!(evidence > most)) continue;
    most = evidence;
    state = std::move(trial);
  }
}

}  // namespace kilotwin::identify
