/// Forward selection with backward elimination: fit, test all hypotheses on the residuals, add the one with the
/// highest evidence, refit; when nothing is significant, test every accepted effect against its alternatives.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/identify/search/score_test.hpp"
#include "clients/identify/search/work.hpp"

namespace kilotwin::identify {

/// Why a term is in the model.
struct Reason {
  std::vector<std::string> covariates;
  std::string acts_on;
  Finding finding;
  double threshold_log10_p = 0;
};

/// An effect that these data cannot separate from an alternative.
struct Ambiguity {
  std::string found, instead;
  std::vector<std::string> found_covariates, covariates;  ///< of the effect and of the alternative
  double evidence_difference = 0;
  std::optional<Term> alternative = {};  ///< nothing: it has no form of its own
};

struct Rejected {
  std::string name;
  std::vector<std::string> covariates;
  std::string acts_on;
  double log10_p = 0, threshold_log10_p = 0;
  std::string why = {};  ///< empty: not significant
};

struct Step {
  std::string added;
  double held_out = 0;
};

/// A model on the way of a search.
struct Stage {
  FitState fit;
  std::vector<Reason> reasons;  ///< one per term of the model
};

/// The state of a search, as one value.
struct Search {
  FitState fit;
  std::vector<Reason> reasons;  ///< one per term of the model
  std::vector<Stage> path;      ///< the base model, then the model after each accepted change
  std::vector<Ambiguity> ambiguous;
  std::vector<Rejected> rejected;  ///< the most significant hypotheses that are not in the model
  std::vector<Step> steps;
  std::string limit;  ///< one sentence if the search ended at one of its limits; empty: nothing passed any more
  std::uint64_t work = 0;  ///< PreparedSet::work at its end
  /// With maps and curves where the model has circles and edges; the last check chooses. Nothing: none was replaced.
  std::optional<Stage> with_curves = {};

  /// A term has got the name of another form: steps and ambiguities follow it.
  void note_renamed(const std::string& from, const std::string& to);
};

/// Limit of a search: accepted changes without general terms. Each of these allows two more.
inline constexpr int kMostRounds = 7;

/// Starts from a fitted base model. `leaves_much`: whether a model leaves a
/// large systematic error of the data of the fit; else only clear general terms are accepted, those without a named form.
[[nodiscard]] Search search(const Fitter&, const FitState& base, const WorkLog&,
                            const std::function<bool(const FitState&)>& leaves_much = {});

}  // namespace kilotwin::identify
