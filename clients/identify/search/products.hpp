/// Effects that are products of functions of different covariates: a map times an amplitude per robot times a step in time.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/fit/fitter.hpp"

namespace kilotwin::identify {

/// The functions whose product a term is, with their present values: one factor with known coefficients per covariate. Blocks of
/// further targets do not count. Empty: the term is a constant, or no such product.
[[nodiscard]] std::vector<Factor> functions_of(const Term&);
/// The blocks of a term on the gain where its coefficients are largest: of both wheels, or of one. A part beside it, as a turn rate,
/// has other units and does not count. Of a term that acts on no gain first all.
[[nodiscard]] Term main_part(const Term&);

/// A term as a product during its fit. One function after the other is open, with its smoothness chosen by evidence, while the
/// others are fixed.
class ProductFit {
 public:
  /// Puts the product of `functions`, each with known coefficients, in place of a term.
  ProductFit(const Fitter&, FitState&, std::size_t term, std::vector<Factor> functions);

  /// Fits all functions in turn until they converge. Each gets a rich shape; those of what only rises in a run may become steps, and maps with edges
  /// grids of values. The function with the richest shape stays open.
  void fit();
  /// Complexity of the product: half the log determinants of the posterior precisions of its functions relative to their priors.
  [[nodiscard]] double cost() const;
  /// The part of the cost that the evidence of the model lacks: of the functions that fit() leaves known.
  [[nodiscard]] double cost_of_known() const;

 private:
  [[nodiscard]] Term& term() { return state_.model.terms[place_]; }
  void turn(std::size_t open, bool rich, int passes);
  [[nodiscard]] std::vector<Block> blocks_of(std::size_t open, bool rich) const;
  void became_steps(std::size_t open);
  void drop_steps(std::size_t open);
  void choose_place_form(std::size_t open);
  bool became_grid(std::size_t open);
  void put_known();
  void reopen_grid(std::size_t open);
  void normalise(std::size_t function);
  void note_cost(std::size_t open);

  const Fitter& fitter_;
  FitState& state_;
  std::size_t place_;
  Target target_;
  std::uint8_t during_;
  std::vector<Factor> functions_;  ///< those of one number per key first, the richest last
  std::vector<double> costs_;
  bool place_form_chosen_ = false;
};

/// Log evidence of each form, some blocks, in place of a term: on the quadratic approximation, with its smoothness at the maximum.
[[nodiscard]] std::vector<double> evidence_of_forms(const Fitter&, const FitState&, std::size_t term,
                                                    const std::vector<std::vector<Block>>& forms);
/// Fits the product of functions in place of a term until it settles. Returns the evidence of the whole model, less the cost of the
/// functions that it leaves known.
double fit_product(const Fitter&, FitState&, std::size_t term, std::vector<Factor> functions);

/// Replaces a term over two covariates by the product of two functions if the log likelihood less the complexity rises. A term of
/// several targets, as a drift, gets an amplitude per target. Returns whether it did.
bool separate(const Fitter&, FitState&, std::size_t term);

/// Whether each function of a term is over the covariate of a function of a product on the same target: without the part, that function
/// of the product takes its share.
[[nodiscard]] bool is_part_of_product(const Term& part, const Term& product);
/// Fits all functions of a product anew, and then lets it act on related targets (target_extension.hpp).
void refit_product(const Fitter&, FitState&, std::size_t term);

/// Run time and motor-on time rise together, and one may stand for the other until all effects are found: puts the other one into a
/// product that has one of them (product_clock.cpp), if the evidence is larger. Returns whether it was.
[[nodiscard]] bool exchange_clock(const Fitter&, FitState&, std::size_t term);

/// Fits the tables of all products anew, with a value for each robot of the tracks: of a model that was fitted to a part of them. A
/// product that becomes less likely stays as it was.
void refit_tables(const Fitter&, FitState&);

}  // namespace kilotwin::identify
