#include "clients/identify/search/amplitudes.hpp"

#include <algorithm>
#include <utility>

#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/target_extension.hpp"

namespace kilotwin::identify {
namespace {

constexpr int kMostTurns = 3;
/// Convergence: gain in log likelihood of one more alternation.
constexpr double kSettled = 2;
/// The merged term has far fewer degrees of freedom, so its log likelihood may be lower by this much.
constexpr double kLikelihoodSlack = 10;

/// Whether `known` is `open` with fixed coefficients.
bool is_known_of(const Factor& known, const Factor& open) {
  return known.shape == open.shape && known.axis == open.axis && known.low == open.low && known.high == open.high &&
         known.count == open.count && known.points == open.points;
}

/// Index of the term whose curve these amplitudes multiply.
std::optional<std::size_t> source_of(const MotionModel& model, const Term& amplitudes) {
  const Block& block = amplitudes.blocks.front();
  if (block.basis.factors.size() != 2) return std::nullopt;
  const auto known = std::find_if(block.basis.factors.begin(), block.basis.factors.end(),
                                  [](const Factor& f) { return !f.known.empty(); });
  if (known == block.basis.factors.end()) return std::nullopt;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Block& of = model.terms[t].blocks.front();
    const std::vector<Factor>& factors = of.basis.factors;
    if (of.target == block.target && of.during == block.during && factors.size() == 1 &&
        factors.front().known.empty() && is_known_of(*known, factors.front()))
      return t;
  }
  return std::nullopt;
}

/// Normalises amplitudes to a mean of 1, which is the amplitude of an unseen robot. If the mean is near 0, the
/// largest becomes 1.
void about_the_mean(Term& term) {
  Factor& amplitudes = term.blocks.front().basis.factors.front();
  if (amplitudes.shape != Factor::Shape::kTable) return;
  const Eigen::Map<Eigen::ArrayXd> each(amplitudes.known.data(),
                                        static_cast<Eigen::Index>(amplitudes.known.size()));
  const double mean = amplitudes.plus + each.mean(), most = (amplitudes.plus + each).abs().maxCoeff();
  if (most == 0) return;
  constexpr double kNextToNone = 0.2;
  const double unit = std::abs(mean) > kNextToNone * most ? mean : most;
  const Eigen::ArrayXd about = (amplitudes.plus + each - mean) / unit;
  Factor scaled = amplitudes;
  scaled.plus = mean / unit;
  scaled.known.assign(about.begin(), about.end());
  for (Block& block : term.blocks) block.basis.factors.front() = scaled;
  term.coefficients *= unit;
  term.precision /= unit * unit;
}

/// Removes blocks with other targets.
void keep_target(Term& term, Target target) {
  std::vector<Block> blocks;
  std::vector<Eigen::Index> columns;
  Eigen::Index next = 0;
  for (Block& block : term.blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    next += n;
    if (block.target != target) continue;
    for (Eigen::Index c = next - n; c < next; ++c) columns.push_back(c);
    blocks.push_back(std::move(block));
  }
  term.blocks = std::move(blocks);
  term.coefficients = Eigen::VectorXd(term.coefficients(columns));
  term.precision = Eigen::VectorXd(term.precision(columns));
}

/// The merged term during the alternating fit.
class CurveTimesAmplitudes {
 public:
  /// Replaces the term `source`, which has the curve, and the last term, which has the amplitudes.
  CurveTimesAmplitudes(const Fitter& fitter, FitState& state, std::size_t source)
      : fitter_(fitter), state_(state), found_(state.model.terms.back()) {
    MotionModel& model = state.model;
    const std::vector<Factor>& factors = found_.blocks.front().basis.factors;
    const auto open = std::find_if(factors.begin(), factors.end(), [](const Factor& f) { return f.known.empty(); });
    open_ = static_cast<std::size_t>(open - factors.begin());
    // The curve enters with amplitude 1. Amplitude columns that were pruned are 0.
    amplitudes_ = *open;
    amplitudes_.known.assign(amplitudes_.columns(), 0);
    amplitudes_.plus = 1;
    add(found_.coefficients);
    Term one = model.terms[source];
    one.name = found_.name;
    // Further targets may have been artefacts of different amplitudes.
    keep_target(one, found_.blocks.front().target);
    for (Block& block : one.blocks) block.basis.factors.insert(block.basis.factors.begin(), amplitudes_);
    model.terms.pop_back();
    model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(source));
    model.terms.push_back(std::move(one));
  }

  void fit() {
    const MotionModel& model = state_.model;
    fitter_.fit(state_, 2);
    likelihood_ = fitter_.log_likelihood(state_);
    in_turns();
    refine_curves(fitter_, state_, model.terms.size() - 1);
    likelihood_ = fitter_.log_likelihood(state_);
    // The curve may have received a constant part, which the amplitudes lacked.
    in_turns();
    if (refine_amplitudes()) in_turns();
    in_turn(true);
    about_the_mean(state_.model.terms.back());
  }
  [[nodiscard]] double log_likelihood() const { return likelihood_; }

 private:
  void add(const Eigen::VectorXd& coefficients) {
    const Basis& basis = found_.blocks.front().basis;
    for (std::size_t i = 0; i < basis.size(); ++i)
      amplitudes_.known[basis.chosen.empty() ? i : basis.chosen[i]] += coefficients[static_cast<Eigen::Index>(i)];
  }
  void in_turns() {
    for (int turns = 0; turns < kMostTurns && in_turn(false); ++turns) {}
  }
  /// The curve of the merged term as known factors, with `open` at the place of the amplitudes.
  [[nodiscard]] std::vector<Factor> times_curve(const Factor& open) const {
    std::vector<Factor> factors{known_curve(state_.model.terms.back(), 1)};
    factors.insert(factors.begin() + static_cast<std::ptrdiff_t>(open_), open);
    return factors;
  }
  void set_amplitudes() {
    for (Block& block : state_.model.terms.back().blocks) block.basis.factors.front() = amplitudes_;
  }
  /// Updates the amplitudes with the curve fixed, then the rest with the amplitudes fixed. Returns whether the
  /// likelihood rose.
  bool in_turn(bool with_smoothness) {
    const FitState before = state_;
    MotionModel& model = state_.model;
    const Factor known = amplitudes_;
    Term changes = found_;
    changes.blocks.resize(1);
    Basis& basis = changes.blocks.front().basis;
    const auto n = static_cast<Eigen::Index>(basis.size());
    changes.coefficients = Eigen::VectorXd::Zero(n);
    changes.precision = found_.precision.head(n).eval();
    basis.factors = times_curve(basis.factors[open_]);
    model.terms.push_back(std::move(changes));
    fitter_.fit(state_, 1);
    add(model.terms.back().coefficients);
    model.terms.pop_back();
    set_amplitudes();
    if (with_smoothness) {
      refit(fitter_, state_, model.terms.size() - 1);
    } else {
      fitter_.fit(state_, 1);
    }
    const double now = fitter_.log_likelihood(state_), gained = now - likelihood_;
    if (gained < 0) {
      state_ = before;
      amplitudes_ = known;
    } else {
      likelihood_ = now;
    }
    return gained > kSettled;
  }
  /// Amplitudes over time, place or heading begin with few columns. Gives them as many as a curve of their own has, with
  /// smoothness by evidence and the curve fixed. Returns whether the likelihood rose.
  bool refine_amplitudes() {
    if (amplitudes_.shape == Factor::Shape::kTable) return false;
    const FitState before = state_;
    MotionModel& model = state_.model;
    Factor open = amplitudes_;
    open.known.clear();
    open.plus = 0;
    open = richer(open);
    Term rich = found_;
    rich.blocks.resize(1);
    Block& block = rich.blocks.front();
    block.basis = Basis{times_curve(open)};
    rich.blocks.push_back(block);
    std::erase_if(rich.blocks[1].basis.factors, [](const Factor& f) { return f.known.empty(); });
    const auto n = static_cast<Eigen::Index>(open.columns());
    rich.coefficients = Eigen::VectorXd::Unit(n + 1, n);
    rich.precision = Eigen::VectorXd::Ones(n + 1);
    const Term curve = std::exchange(model.terms.back(), std::move(rich));
    fitter_.fit(state_, 1);
    refit(fitter_, state_, model.terms.size() - 1);
    const Term& refined = model.terms.back();
    // Without its constant, or without more than that, nothing is gained.
    if (refined.blocks.size() < 2) {
      state_ = before;
      return false;
    }
    Term found = refined;
    found.blocks.resize(1);
    const auto own = static_cast<Eigen::Index>(found.blocks.front().basis.size());
    found.coefficients = refined.coefficients.head(own).eval();
    found.precision = refined.precision.head(own).eval();
    const Factor known = std::exchange(amplitudes_, open);
    const Term coarse = std::exchange(found_, found);
    amplitudes_.known.assign(open.columns(), 0);
    amplitudes_.plus = refined.coefficients[own];
    add(found.coefficients);
    model.terms.back() = curve;
    set_amplitudes();
    fitter_.fit(state_, 1);
    const double now = fitter_.log_likelihood(state_);
    if (now > likelihood_) {
      likelihood_ = now;
      return true;
    }
    state_ = before;
    amplitudes_ = known;
    found_ = coarse;
    return false;
  }

  const Fitter& fitter_;
  FitState& state_;
  Term found_;
  std::size_t open_ = 0;  ///< index of the factor in the found term that is not the curve
  Factor amplitudes_;
  double likelihood_ = 0;
};

}  // namespace

std::optional<std::size_t> merge_amplitudes(const Fitter& fitter, FitState& state) {
  const std::optional<std::size_t> source = source_of(state.model, state.model.terms.back());
  if (!source) return std::nullopt;
  FitState trial = state;
  CurveTimesAmplitudes one(fitter, trial, *source);
  one.fit();
  if (one.log_likelihood() <= fitter.log_likelihood(state) - kLikelihoodSlack) return std::nullopt;
  extend_targets(fitter, trial, trial.model.terms.size() - 1);
  state = std::move(trial);
  return source;
}

bool multiplies_known_curve(const Term& term) {
  return std::any_of(term.blocks.begin(), term.blocks.end(), [](const Block& block) {
    return std::any_of(block.basis.factors.begin(), block.basis.factors.end(),
                       [](const Factor& factor) { return !factor.known.empty() && factor.plus == 0; });
  });
}

}  // namespace kilotwin::identify
