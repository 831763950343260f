#include "clients/identify/search/parallax.hpp"

#include <algorithm>
#include <utility>

namespace kilotwin::identify {
namespace {

/// Least gain in log evidence: a Bayes factor of 20.
constexpr double kFootEvidence = 3;
/// Prior standard deviation of the camera's foot along an axis, mm.
constexpr double kFoot_mm = 300;
/// Alternations between the scales and the foot.
constexpr int kFootTurns = 4;

/// Whether the term is a scale per robot, and nothing else.
bool is_scale_of_robots(const Term& term) {
  if (term.blocks.size() != 1 || term.blocks.front().target != Target::kMeasuredScale) return false;
  const Basis& basis = term.blocks.front().basis;
  return basis.factors.size() == 1 && basis.factors.front().shape == Factor::Shape::kTable &&
         basis.factors.front().axis.of == Covariate::kRobot && basis.factors.front().known.empty();
}

}  // namespace

bool fit_camera_foot(const Fitter& fitter, FitState& state, std::size_t place) {
  if (!is_scale_of_robots(state.model.terms[place])) return false;
  FitState trial = state;
  Term& term = trial.model.terms[place];
  const auto scales = term.coefficients.size();
  // p + h (p - foot) = p (1 + h) - h foot: offsets in proportion to the scale h of the robot.
  const auto offsets = [&] { return Basis{{known_curve(term, 0)}}; };
  const Basis first = offsets();
  term.blocks.push_back({Target::kMeasuredX, first, kAlways});
  term.blocks.push_back({Target::kMeasuredY, first, kAlways});
  term.coefficients.conservativeResize(scales + 2);
  term.coefficients.tail(2).setZero();
  term.precision.conservativeResize(scales + 2);
  term.precision.tail(2).setConstant(1 / (kFoot_mm * kFoot_mm));
  for (int turn = 0; turn < kFootTurns; ++turn) {
    const Basis of_scales = offsets();
    term.blocks[1].basis = term.blocks[2].basis = of_scales;
    fitter.fit(trial, 1);
  }
  // Negated, so that an evidence that is no number does not count.
  if (!(fitter.log_evidence(trial) > fitter.log_evidence(state) + kFootEvidence)) return false;
  state = std::move(trial);
  return true;
}

}  // namespace kilotwin::identify
