#include "clients/identify/search/amplitudes.hpp"

#include <algorithm>
#include <utility>

#include "clients/identify/search/products.hpp"
#include "clients/identify/search/target_extension.hpp"

namespace kilotwin::identify {
namespace {

/// The merged term has far fewer degrees of freedom, so its log likelihood may be lower by this much.
constexpr double kLikelihoodSlack = 10;

/// Whether two known factors are the same function, up to its coefficients.
bool alike(const Factor& a, const Factor& b) {
  return a.shape == b.shape && a.axis == b.axis && a.low == b.low && a.high == b.high && a.count == b.count &&
         (a.shape == Factor::Shape::kGrid ? a.points.size() == b.points.size() : a.points == b.points);
}

bool is_known(const Factor& f) { return !f.known.empty(); }

/// Index of the term whose function these amplitudes multiply.
std::optional<std::size_t> source_of(const MotionModel& model, const Term& amplitudes) {
  const Block& block = amplitudes.blocks.front();
  std::vector<Factor> known = block.basis.factors;
  std::erase_if(known, [](const Factor& f) { return !is_known(f); });
  if (known.empty() || block.basis.factors.size() != known.size() + 1) return std::nullopt;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    if (&model.terms[t] == &amplitudes) continue;
    const Term part = main_part(model.terms[t]);
    if (part.blocks.front().target != block.target || part.blocks.front().during != block.during) continue;
    const std::vector<Factor> functions = functions_of(part);
    if (std::equal(known.begin(), known.end(), functions.begin(), functions.end(), alike)) return t;
  }
  return std::nullopt;
}

/// The fitted amplitudes as a known factor, 1 without their coefficients.
Factor amplitudes_of(const Term& term) {
  const Basis& basis = term.blocks.front().basis;
  Factor amplitudes = *basis.only_open();
  amplitudes.known.assign(amplitudes.columns(), 0);
  amplitudes.plus = 1;
  for (std::size_t i = 0; i < basis.size(); ++i)
    amplitudes.known[basis.chosen.empty() ? i : basis.chosen[i]] = term.coefficients[static_cast<Eigen::Index>(i)];
  if (!amplitudes.of_two()) return amplitudes;
  // A map as values at nodes, with the constant as a block of its own.
  Term map{"", {{Target::kOffset, Basis{{*basis.only_open()}, basis.chosen}}, {Target::kOffset, {}}}, {}, {}};
  map.coefficients.resize(term.coefficients.size() + 1);
  map.coefficients << term.coefficients, 1;
  map.precision = Eigen::VectorXd::Ones(map.coefficients.size());
  const std::vector<Factor> functions = functions_of(map);
  return functions.empty() ? amplitudes : functions.front();
}

}  // namespace

std::optional<std::size_t> merge_amplitudes(const Fitter& fitter, FitState& state) {
  const std::optional<std::size_t> source = source_of(state.model, state.model.terms.back());
  if (!source) return std::nullopt;
  FitState trial = state;
  std::vector<Factor> functions = functions_of(main_part(trial.model.terms[*source]));
  functions.push_back(amplitudes_of(trial.model.terms.back()));
  trial.model.terms.erase(trial.model.terms.begin() + static_cast<std::ptrdiff_t>(*source));
  ProductFit product(fitter, trial, trial.model.terms.size() - 1, std::move(functions));
  product.fit();
  // First, parts of the other term beside its gain get back what they explain.
  extend_targets(fitter, trial, trial.model.terms.size() - 1);
  if (fitter.log_likelihood(trial) <= fitter.log_likelihood(state) - kLikelihoodSlack) return std::nullopt;
  state = std::move(trial);
  return source;
}

bool multiplies_term(const MotionModel& model, const Term& term) { return source_of(model, term).has_value(); }

}  // namespace kilotwin::identify
