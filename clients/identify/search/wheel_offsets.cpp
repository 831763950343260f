#include "clients/identify/search/wheel_offsets.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

/// Least gain in log evidence: a Bayes factor of 20.
constexpr double kOffsetsEvidence = 3;

constexpr std::uint8_t bit_of_motion(Motion motion) {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(motion));
}

/// Commands under which the wheels change.
struct WheelCommands {
  std::uint8_t of_left, of_right;
};
/// Commands under which each wheel is driven alone or with the other one: a right turn drives the left wheel.
constexpr std::uint8_t kLeftMoves = bit_of_motion(Motion::kStraight) | bit_of_motion(Motion::kRight),
                       kRightMoves = bit_of_motion(Motion::kStraight) | bit_of_motion(Motion::kLeft);
constexpr std::array<WheelCommands, 2> kWheelForms = {WheelCommands{kDriven, kDriven},
                                                      WheelCommands{kLeftMoves, kRightMoves}};

/// Whether the block has one amplitude per robot from an instant on.
bool is_switch_of_robots(const Block& block) {
  if (block.target != Target::kTurn && block.target != Target::kGain) return false;
  const std::vector<Factor>& factors = block.basis.factors;
  const auto any = [&](Factor::Shape shape, Covariate of) {
    return std::any_of(factors.begin(), factors.end(),
                       [&](const Factor& f) { return f.shape == shape && f.axis.of == of && f.known.empty(); });
  };
  return factors.size() == 2 && any(Factor::Shape::kTable, Covariate::kRobot) &&
         any(Factor::Shape::kAtLeast, Covariate::kTime);
}

}  // namespace

bool replace_by_wheel_offsets(const Fitter& fitter, FitState& state, std::size_t place) {
  const std::vector<Block> had = state.model.terms[place].blocks;
  if (had.empty() || !std::all_of(had.begin(), had.end(), is_switch_of_robots)) return false;
  double best = fitter.log_evidence(state) + kOffsetsEvidence;
  std::optional<FitState> replaced;
  for (const WheelCommands& during : kWheelForms) {
    // One block for all robots, or one for each with an instant of its own.
    std::vector<Block> blocks;
    for (const Block& block : had) {
      blocks.push_back({Target::kOffsetLeft, block.basis, during.of_left});
      blocks.push_back({Target::kOffsetRight, block.basis, during.of_right});
    }
    FitState trial = state;
    trial.model.terms[place].name = "bias-by-robot-and-time";
    refine_to(fitter, trial, place, blocks);
    fitter.fit(trial, 2);
    if (const double evidence = fitter.log_evidence(trial); evidence > best) {
      best = evidence;
      replaced = std::move(trial);
    }
  }
  if (!replaced) return false;
  state = std::move(*replaced);
  return true;
}

}  // namespace kilotwin::identify
