/// The loop: fit, look at what is left, add its cause, until nothing is left that could not be chance; then let every cause
/// defend its place against all others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/search/score_test.hpp"

namespace kilotwin::identify {

/// Why a term is in the model.
struct Reason {
  std::vector<std::string> covariates;
  std::string acts_on;
  Finding finding;
  double threshold_log10_p = 0;
};

/// A cause that this data cannot tell from another.
struct Ambiguity {
  std::string found, instead;
  std::vector<std::string> found_covariates, covariates;  ///< of the one and of the other
  double evidence_difference = 0;
};

struct Rejected {
  std::string name;
  std::vector<std::string> covariates;
  std::string acts_on;
  double log10_p = 0, threshold_log10_p = 0;
};

struct Step {
  std::string added;
  double held_out = 0;
};

struct Search {
  MotionModel model;
  std::vector<Reason> reasons;  ///< of the model's terms
  std::vector<Ambiguity> ambiguous;
  std::vector<Rejected> rejected;  ///< the most surprising of what is not in the model
  std::vector<Step> steps;
};

/// Starts from a fitted base model. `progress` gets 0..1.
[[nodiscard]] Search search(const Fitter&, const MotionModel& base,
                            const std::function<void(double, const std::string&)>& progress);

}  // namespace kilotwin::identify
