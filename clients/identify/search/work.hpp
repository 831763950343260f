/// The work of an identification from trajectories, as units of kinds with costs: for the estimate of the remaining time.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/stats/time_left.hpp"

namespace kilotwin::identify {

/// In the order of their first units. The search repeats the kinds from kTest to kGeneralTerms.
enum WorkKind {
  kBaseModel,
  kTest,          ///< of all hypotheses, on the residuals of the model
  kAddition,      ///< of one term: its fit, and backward elimination
  kAlternatives,  ///< of each term, when nothing passes any more
  kGeneralTerms,  ///< terms without a named form
  kTermChecks,    ///< the model without each term, on the data of the fit
  kLastCheck,     ///< on held-out data
  kErrors,
  kUnexplained,
  kHorizon,
  kSimulation,
  kReport,  ///< the page, which the caller draws
};

class WorkLog {
 public:
  explicit WorkLog(stats::WorkReport report) : report_(std::move(report)) {}
  /// A unit begins. `terms`: of the model, with a term that the unit adds. `most_changes`: of the model, after this unit; nothing: no
  /// search follows.
  void begin(WorkKind, const std::string& stage, const std::string& activity, std::size_t terms,
             std::optional<int> most_changes = std::nullopt) const;

 private:
  stats::WorkReport report_;
};

}  // namespace kilotwin::identify
