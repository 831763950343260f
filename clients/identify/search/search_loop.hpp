/// The loop of a search, as its parts see it: tests of hypotheses (search_tests.cpp), additions (search.cpp), forms that no dictionary
/// holds and general terms (search_forms.cpp), exchanges and removals (search_exchanges.cpp), shapes of terms (search_shapes.cpp).
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/score_test.hpp"
#include "clients/identify/search/search.hpp"

namespace kilotwin::identify {

/// An attempt of the search. One that failed is not repeated.
struct Attempt {
  enum class Kind : std::uint8_t {
    kNamed,       ///< a hypothesis with a named form
    kGeneral,     ///< a general term
    kWaveForm,    ///< a wave among general terms, whose name it may have
    kCircleForm,  ///< a moving circle beside other terms, with the same names
    kWave,        ///< a wave among named hypotheses
    kLoneCircle,  ///< a moving circle in place of terms, if it leaves no hypothesis
    kCircle,      ///< a moving circle in place of terms
    kExchange,    ///< the first hypothesis in place of a term, the second
    kClock        ///< another clock in the products among these terms
  };
  Kind kind;
  std::vector<std::string> names;
  Tail tail = Tail::kOfColumns;  ///< by which it passed
  auto operator<=>(const Attempt&) const = default;
};

/// One search. Its state is one value, so that an attempt that fails is undone by assignment.
class SearchLoop {
 public:
  SearchLoop(const Fitter&, const FitState& base, const WorkLog&,
             const std::function<bool(const FitState&)>& leaves_much);
  [[nodiscard]] Search run();

 private:
  /// Seed of the random signs of the test, with the round added. Another one changes p values within their chance.
  static constexpr std::uint64_t kSeed = 20180729;
  /// Effects with log evidence closer than this (a Bayes factor of 20) count as ambiguous.
  static constexpr double kClose = 3;
  /// Least rise of the log likelihood by a new term.
  static constexpr double kLeastRise = 3;
  /// No form is exact. A hypothesis that explains less than this share of the total gain counts as a remnant.
  static constexpr double kRemnant = 0.003;
  /// Largest number of samples in the test. More add cost and no power that is needed.
  static constexpr std::size_t kEnoughSamples = 130000;

  /// A general term, a wave or a circle that passed, with its reason.
  struct GeneralTerm {
    Attempt attempt;
    Term term;
    Reason reason;
  };
  using Candidates = std::map<Attempt, GeneralTerm>;
  /// Alternatives to the effect that was accepted last.
  struct Alternatives {
    std::optional<Search> before;  ///< nothing before the first round
    std::string chosen;
    std::map<std::string, std::pair<Term, Reason>> by_name;  ///< by name
  };

  // Rounds and additions (search.cpp).

  /// Makes one change of the model: an addition, or at a limit and when nothing passes a removal or an exchange.
  /// Returns false if there is none.
  bool changed();
  /// The limit that the search has reached, in one sentence; empty: none. It then adds nothing more.
  [[nodiscard]] std::string limit() const;
  /// Tests all hypotheses and adds the one with the most evidence that fits. Returns whether there is one.
  bool accept_hypothesis(Tail);
  /// Adds a hypothesis that passed. Returns false, with the state as before, if the likelihood does not rise by kLeastRise. The predicted
  /// gain is no bound: it is linear, and far off along directions that the model nearly contains.
  bool accepted(const Finding& best, const ScoreTest::Outcome& outcome, Tail);
  /// A lag that was fitted before a term may have been off: refits it, and takes out what it explains then.
  void refit_lag();
  /// A term may be what looked like a lag, as speed does that builds up after a command: it may then explain more without one, and
  /// the small steps of a refit don't reach lag 0. Returns whether the model has no lag now.
  bool became_punctual();
  void say(WorkKind kind, std::string activity) const;
  /// Whether a lag between commands and motion, one number, explains most of what the best hypothesis explains. Then
  /// the model gets the lag.
  bool lag_explains(const Finding& best);
  /// Adds calibration shifts of the camera. Returns whether there were any.
  bool accept_calibration_shifts();
  void add(const Finding& found, double threshold);
  /// Refines the shape of a term. Returns whether that recovers most of the expected gain of a further term.
  bool recovered_by_refinement(std::size_t place, double expected_gain);
  /// Whether the last term, amplitudes of an accepted curve, was merged with it.
  bool merged();
  [[nodiscard]] bool worked_out() const;
  /// Log likelihood away from walls and other robots, and of all.
  struct Likelihoods {
    double away, of_all;
  };
  [[nodiscard]] Likelihoods likelihoods_now() const;
  /// Whether that of all rose; by Tail::kOfClusters also, whether the other one did. A refit of contacts lowers that of all: their
  /// noise covers pushes that persist, which is more than the likelihood of single steps asks for. It also decides which rows are away.
  [[nodiscard]] bool rose_from(const Likelihoods& before, Tail) const;
  void note_stage() { out_.path.push_back({out_.fit, out_.reasons}); }
  /// Gain in log likelihood of all accepted effects.
  [[nodiscard]] double explained() const { return fitter_.log_likelihood_of_all(out_.fit) - base_likelihood_; }

  // Tests (search_tests.cpp).

  /// The tracks of the test. A large set: every n-th unit.
  [[nodiscard]] std::vector<std::vector<const TrackView*>> tested_units(
      std::size_t most_samples = kEnoughSamples) const;
  /// Length of the stretches of tracks that the test takes as independent. The second look is made where a large effect may be left: its
  /// scores keep their sign as long as robots keep their place or command. Shorter stretches then leave more of them, and more power.
  static constexpr double stretch_s(Tail tail) { return tail == Tail::kOfClusters ? 30 : 100; }
  void score_dictionary(Tail tail = Tail::kOfColumns);
  const Finding* best_of(const ScoreTest::Outcome& outcome, double least_evidence, Tail) const;
  static bool of_robots_and_more(const Hypothesis& h);
  /// Evidence of the two single effects (of robots, and of the other covariate) if either is significant: the
  /// alternative to their combination.
  double parts_evidence(const Hypothesis& pair, const ScoreTest::Outcome& outcome) const;
  static bool good(const Finding& f, double threshold);
  static bool clear(const Finding& f, double threshold);
  /// Whether a hypothesis beside the model passes the tests and explains a fair share of what its terms explain.
  bool leaves_hypothesis();
  void note_rejected(const ScoreTest::Outcome& outcome);
  void note_ambiguous(const Finding& best, const ScoreTest::Outcome& outcome);
  const Hypothesis& hypothesis(const Finding& f) const { return dictionary_.hypotheses[f.hypothesis]; }

  // Waves, moving circles and general terms (search_forms.cpp).

  /// Adds the hypotheses of a family that pass the tests, of each name the one with the most evidence, by kind and name. `screening`:
  /// only clear ones.
  void add_candidates(const Dictionary& family, Attempt::Kind, double least_evidence, Candidates& best,
                      Tail tail = Tail::kOfColumns, bool screening = false);
  /// Those of all families, in the order of their evidence. `screening`: only clear ones.
  std::vector<GeneralTerm> general_candidates(Tail, bool screening);
  /// Adds a term. Returns false, with the state as before, if the likelihood does not rise. `attempt`: noted as
  /// failed.
  bool fits(GeneralTerm one, const Attempt& attempt);
  /// A travelling wave with more evidence than the best hypothesis, which may be a proxy of it: adds the wave. A wave that
  /// repeats neither within a run nor on the floor is left to the other hypotheses: it may be a proxy itself.
  bool accept_wave(double evidence);
  /// Whether a term is an effect on the speed: of the position or of what only rises in a run, for all robots or each. Moving circles are
  /// none.
  [[nodiscard]] bool may_be_part_of_circle(std::size_t t) const;
  /// Whether effects of both were found that a moving circle may replace. Its further proxies would cost many rounds.
  [[nodiscard]] bool has_parts_of_circle() const;
  /// Effects of position and of what only rises can be proxies of a circle that moves or grows: tries one in place of all of them. It stays
  /// if the evidence of the whole model is larger. `alone`: and if no hypothesis finds much beside it. Otherwise the effects may grow
  /// into a product that explains more.
  bool accept_moving_circle(bool alone);
  /// Puts the product of two such effects, one of the position and one of what only rises, in place of both if the evidence of the whole
  /// model exceeds `evidence`: a part of the arena that changes at once.
  bool became_product_of_parts(double evidence);
  /// Puts a product of functions in place of two terms, and fits. The evidence of the whole model.
  double evidence_of_product(std::size_t of_place, std::size_t rising, std::vector<Factor> functions);
  /// Adds a moving circle beside the other terms, if it passes the tests. Returns whether there is one.
  bool accept_further_circle();
  /// Adds the general term with the most evidence that fits. If the error is near what the model expects, only a clear one: an effect
  /// that looks like noise raises what the model expects. Returns whether there is one.
  bool accept_general(Tail);

  // Removals and exchanges (search_exchanges.cpp).

  /// Backward elimination and exchange. Returns whether a term was removed or replaced, so that the search must
  /// continue.
  bool eliminate();
  /// A hypothesis in place of a term.
  struct Contender {
    const Hypothesis* hypothesis;
    Finding finding;
  };
  /// Exchanges a term, whose evidence is `own`, for a hypothesis with clearly more evidence in its place, or for one with about as much
  /// that fits better.
  bool exchanged(std::size_t place, const Finding& own);
  /// Exchanges run time and motor-on time in products. A residual of the wrong one would pass the tests as further terms.
  void exchange_clocks();
  /// Replaces the last term, of two covariates, by a product of two functions: its columns leave residuals that would pass the tests as one
  /// further term after another. First, another hypothesis may replace it: a product can resemble much.
  void separate_last();
  /// Puts a hypothesis in place of a term, and fits.
  void put(std::size_t place, const Contender& other);
  /// Exchanges a term for another hypothesis. The quadratic approximation may overestimate its evidence: restores
  /// the state if the likelihood falls.
  bool exchanged_for(std::size_t place, const Contender& other);
  /// The same if the evidence of the settled model is larger by `margin` than that of the present one, settled too. Otherwise the term
  /// stays, settled.
  bool fits_better(std::size_t place, const Contender& other, double margin);
  /// Refines the shape of a term, and fits everything until it settles.
  void settle(std::size_t place);
  /// Contacts show whether the robots move or the camera does: measurements after contacts count only where that is the question.
  [[nodiscard]] bool acts_on_camera(std::size_t place) const;
  [[nodiscard]] double evidence_with_contacts() const;
  /// Tests camera motion against a drift of the robots. Robots at rest and walls separate the two.
  void try_camera_motion();
  /// Whether a term is the constant part of another one.
  static bool is_constant_of(const Term& term, const Term& other);
  /// A new effect may explain what earlier terms were accepted for, unless it has far less evidence. Tries to
  /// remove each earlier term, with the shape of the new one refined.
  void eliminate_earlier();
  /// The product that could take the share of a term over some of its covariates.
  [[nodiscard]] std::optional<std::size_t> product_with(std::size_t part) const;
  /// Removes a term unless the evidence falls. The product that takes its share is fitted anew, or the shape of the last term
  /// refined.
  bool removed(std::size_t t, bool shape_last);
  /// A hypothesis with the name of the best one and nearly its evidence, over another covariate: the neighbours that drive in place of all.
  /// The linear evidence cannot tell them apart. Null: there is none, or the model has a term of this name.
  [[nodiscard]] const Finding* other_form(const Finding& best, const ScoreTest::Outcome&) const;
  void note_alternatives(const Finding& best, const ScoreTest::Outcome& outcome);
  /// Whether an alternative to the last accepted effect, which is now significant beside it, has more evidence in
  /// its place.
  bool replaced_by_alternative(const std::string& name);

  // Shapes (search_shapes.cpp).

  /// Refines the shape of a term. It may get another name.
  void refine_shape(std::size_t place);
  void refine_form(std::size_t place);
  /// Replaces curves per robot or command by amplitudes from an instant on, and these by a change of each wheel, if the evidence
  /// rises. Returns whether there is an instant.
  bool became_switch(std::size_t place);

  const Fitter& fitter_;
  const WorkLog& log_;
  const std::function<bool(const FitState&)>& leaves_much_;
  std::vector<Dictionary> general_;  ///< empty: not needed yet
  const Extent extent_;
  const std::uint64_t worked_before_;  ///< PreparedSet::work at its start: a second search has a limit of its own
  Dictionary dictionary_;              ///< hypotheses in addition to the model
  std::optional<ScoreTest> score_test_;
  Search out_;
  double base_likelihood_ = 0;
  Alternatives alternatives_;
  std::set<Attempt> failed_;
  int general_terms_ = 0, eliminations_ = 0, round_ = 0, failures_ = 0;
  bool starts_anew_ = false;  ///< with a lag
};

}  // namespace kilotwin::identify
