/// Plans a recording: the commands and start places that answer a question with the most information per minute.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/identify/design/innovations.hpp"
#include "clients/identify/design/question.hpp"
#include "core/stats/time_left.hpp"

namespace kilotwin::identify {

struct DesignOptions {
  std::uint32_t robots = 20;
  double duration_s = 120;
  PlanArena arena;
  std::uint64_t seed = 1;
  std::uint32_t threads = 2;
  std::uint32_t sweeps = 200;      ///< trials of another plan for every robot
  std::uint32_t random_plans = 8;  ///< to compare with
  stats::WorkReport progress;      ///< may be empty
};

/// Expected information up to an instant.
struct InformationCurve {
  std::vector<double> at_s, nat;

  /// First instant with this much, linear in between; infinite if it is never reached.
  [[nodiscard]] double reaches_s(double nat_needed) const;
};

struct Design {
  RecordingPlan plan;
  InformationCurve planned;
  std::vector<InformationCurve> random;  ///< of random commands from random places
  /// Information of random commands by the end, mean of the plans.
  double random_nat = 0;
  /// Compared quantities. needed_nat: the information of random commands by the end, at most a decision. planned_s and random_s: when the plan
  /// and random commands reach it; the latter is a mean, in which a plan that does not reach it counts with the end.
  double needed_nat = 0, planned_s = 0, random_s = 0;
  /// Expected standard deviations of the columns after the recording; only of a question of parameters.
  std::vector<double> sd_after;

  /// Share of the recording time that the plan saves for this information; 0 if it gives no more.
  [[nodiscard]] double saved() const;
};

/// Expected log likelihood ratio that decides between two models: with its standard deviation of sqrt(2 E) about E, nine of ten recordings
/// give more than 3 nat, a Bayes factor of 20.
inline constexpr double kDecision_nat = 10;

/// Robots start anywhere, and get a new random command every 6 s in the mean: straight on, a turn to the left, one to the right, or rest,
/// in the proportions 2, 1, 1, 1. `number` numbers the plans of a seed.
[[nodiscard]] RecordingPlan random_plan(const DesignOptions&, std::uint32_t number);

/// Expected information of a plan: mean over several draws of the process noise, with contacts between robots.
[[nodiscard]] InformationCurve information_of(const RecordingPlan&, const DesignQuestion&,
                                              const RecordingConditions&, std::uint32_t threads);

/// Coordinate exchange from a random plan (Meyer and Nachtsheim 1995): each sweep tries another start, or another motion in some interval,
/// for every robot, and keeps what adds information: of parameters, by the end; of models, as early as possible up to a decision. The result is the best of that plan and the random ones, all judged with contacts
/// and with draws of the noise that the search did not see.
/// Deterministic in its arguments.
[[nodiscard]] Design design_recording(const DesignQuestion&, const RecordingConditions&, const DesignOptions&);

}  // namespace kilotwin::identify
