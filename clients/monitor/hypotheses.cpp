#include "clients/monitor/hypotheses.hpp"

#include <array>

namespace kilotwin::monitor {
namespace {

// Standard deviations of sizes that a change of a Kilobot or its arena is expected to have.
constexpr double kGainSd = 0.5, kBias_mm_s = 2, kTurn_rad_s = 0.2, kHeading_rad = 0.5, kDrift_mm_s = 3;
constexpr double kShift_mm = 20, kShift_rad = 0.05;

constexpr std::array<Hypothesis, 9> kOfRobots{{
    {Suspect::kGainLeft, Group::kGain, {{kGainSd}}},
    {Suspect::kGainRight, Group::kGain, {{kGainSd}}},
    {Suspect::kGain, Group::kGain, {{kGainSd}}},
    {Suspect::kBiasLeft, Group::kBias, {{kBias_mm_s}}},
    {Suspect::kBiasRight, Group::kBias, {{kBias_mm_s}}},
    {Suspect::kTurnRate, Group::kBias, {{kTurn_rad_s}}},
    {Suspect::kDrift, Group::kDrift, {{kDrift_mm_s, kDrift_mm_s}}},
    {Suspect::kHeading, Group::kHeading, {{kHeading_rad}}},
    {Suspect::kJump, Group::kShift, {{kShift_mm, kShift_mm}}},
}};
constexpr Hypothesis kGainOfAll{Suspect::kGainOfAll, Group::kGain, {{kGainSd}}};
constexpr Hypothesis kDriftOfAll{Suspect::kDriftOfAll, Group::kDrift, {{kDrift_mm_s, kDrift_mm_s}}};
constexpr Hypothesis kCalibrationShift{
    Suspect::kCalibrationShift, Group::kShift, {{kShift_mm, kShift_mm, kShift_rad}}};
constexpr Hypothesis kPatch{Suspect::kPatch, Group::kGain, {{kGainSd}}};

Sums one(double score, double information) { return {1, {score}, {information}}; }

/// The sums of weight_a * a + weight_b * b as one size.
Sums combined(const Signatures& s, std::size_t a, double weight_a, std::size_t b, double weight_b,
              std::size_t slot) {
  return one(weight_a * s.score(a, slot) + weight_b * s.score(b, slot),
             weight_a * weight_a * s.information(a, a, slot) + 2 * weight_a * weight_b * s.information(a, b, slot) +
                 weight_b * weight_b * s.information(b, b, slot));
}

Sums single(const Signatures& s, std::size_t column, std::size_t slot) {
  return one(s.score(column, slot), s.information(column, column, slot));
}

}  // namespace

std::span<const Hypothesis> robot_hypotheses() { return kOfRobots; }
const Hypothesis& gain_of_all() { return kGainOfAll; }
const Hypothesis& drift_of_all() { return kDriftOfAll; }
const Hypothesis& calibration_shift() { return kCalibrationShift; }
const Hypothesis& patch() { return kPatch; }

Sums shift_sums(const Signatures& s, std::size_t first, std::size_t slot, std::size_t dimensions) {
  Sums sums;
  sums.dimensions = dimensions;
  for (std::size_t a = 0; a < dimensions; ++a) sums.score[a] = s.score(first + a, slot);
  const auto info = [&](std::size_t a, std::size_t b) { return s.information(first + a, first + b, slot); };
  sums.information = {info(0, 0), info(0, 1), 0, info(1, 1), 0, 0};
  if (dimensions == 3) {
    sums.information[2] = info(0, 2);
    sums.information[4] = info(1, 2);
    sums.information[5] = info(2, 2);
  }
  return sums;
}

Sums sums_of(Suspect suspect, const Signatures& s, std::size_t slot, double wheel_base_mm) {
  switch (suspect) {
    case Suspect::kGainLeft: return single(s, kGainLeft, slot);
    case Suspect::kGainRight: return single(s, kGainRight, slot);
    case Suspect::kGain:
    case Suspect::kGainOfAll:
    case Suspect::kPatch: return combined(s, kGainLeft, 1, kGainRight, 1, slot);
    case Suspect::kBiasLeft: return single(s, kBiasLeft, slot);
    case Suspect::kBiasRight: return single(s, kBiasRight, slot);
    case Suspect::kTurnRate: return combined(s, kBiasLeft, -wheel_base_mm / 2, kBiasRight, wheel_base_mm / 2, slot);
    case Suspect::kDrift:
    case Suspect::kDriftOfAll: return shift_sums(s, kDriftX, slot, 2);
    case Suspect::kHeading: return single(s, kHeading, slot);
    case Suspect::kJump: return shift_sums(s, kShiftX, slot, 2);
    case Suspect::kCalibrationShift: return shift_sums(s, kShiftX, slot, 3);
  }
  return {};
}

}  // namespace kilotwin::monitor
