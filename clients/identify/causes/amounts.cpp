#include "clients/identify/causes/amounts.hpp"

#include <algorithm>

#include "clients/identify/causes/refine.hpp"
#include "clients/identify/causes/widen.hpp"

namespace kilotwin::identify {
namespace {

constexpr int kMostTurns = 3;
/// A gain in log likelihood for which curve and amounts are not fitted in turn once more.
constexpr double kSettled = 2;
/// One term of which the curve is known has far fewer freedoms than two: so much less likely it may be.
constexpr double kAsGood = 10;

/// Factor `a` as it is and `b` as a curve of it that is known.
bool is_known_of(const Factor& known, const Factor& open) {
  return known.shape == open.shape && known.axis == open.axis && known.low == open.low && known.high == open.high &&
         known.count == open.count && known.points == open.points;
}

/// The term whose curve the amounts of `amounts` are of.
std::optional<std::size_t> source_of(const MotionModel& model, const Term& amounts) {
  const Block& block = amounts.blocks.front();
  if (block.basis.factors.size() != 2) return std::nullopt;
  const auto known = std::find_if(block.basis.factors.begin(), block.basis.factors.end(),
                                  [](const Factor& f) { return !f.known.empty(); });
  if (known == block.basis.factors.end()) return std::nullopt;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Block& of = model.terms[t].blocks.front();
    if (of.target == block.target && of.during == block.during && of.basis.factors.size() == 1 &&
        of.basis.factors.front().known.empty() && is_known_of(*known, of.basis.factors.front()))
      return t;
  }
  return std::nullopt;
}

/// The first block's curve, as the coefficients are now.
Factor curve_of(const Term& term, std::size_t factor) {
  const Basis& basis = term.blocks.front().basis;
  Factor curve = basis.factors[factor];
  curve.known.assign(curve.columns(), 0);
  for (std::size_t i = 0; i < basis.size(); ++i)
    curve.known[basis.chosen.empty() ? i : basis.chosen[i]] = term.coefficients[static_cast<Eigen::Index>(i)];
  return curve;
}

/// Amounts of keys are told relative to their mean, which is that of a robot that nobody has seen. Where they have next to none, the
/// largest is 1.
void about_the_mean(Term& term) {
  Factor& amounts = term.blocks.front().basis.factors.front();
  if (amounts.shape != Factor::Shape::kTable) return;
  const Eigen::Map<Eigen::ArrayXd> each(amounts.known.data(), static_cast<Eigen::Index>(amounts.known.size()));
  const double mean = amounts.plus + each.mean(), most = (amounts.plus + each).abs().maxCoeff();
  if (most == 0) return;
  constexpr double kNextToNone = 0.2;
  const double unit = std::abs(mean) > kNextToNone * most ? mean : most;
  const Eigen::ArrayXd about = (amounts.plus + each - mean) / unit;
  Factor scaled = amounts;
  scaled.plus = mean / unit;
  scaled.known.assign(about.begin(), about.end());
  for (Block& block : term.blocks) block.basis.factors.front() = scaled;
  term.coefficients *= unit;
  term.precision /= unit * unit;
}

}  // namespace

std::optional<std::size_t> join_amounts(const Fitter& fitter, MotionModel& model, std::size_t place) {
  const std::optional<std::size_t> source = source_of(model, model.terms[place]);
  if (!source) return std::nullopt;
  const MotionModel was = model;
  const double likelihood = fitter.log_likelihood(was);
  const Term found = model.terms[place];
  const Block& more = found.blocks.front();
  const std::size_t which = more.basis.factors[0].known.empty() ? 0 : 1;
  // Everything has the curve once, but for what was found of its amount. What was left out of the amounts' columns is none.
  Factor amounts = more.basis.factors[which];
  amounts.known.assign(amounts.columns(), 0);
  amounts.plus = 1;
  const auto add = [&](const Eigen::VectorXd& coefficients) {
    for (std::size_t i = 0; i < more.basis.size(); ++i)
      amounts.known[more.basis.chosen.empty() ? i : more.basis.chosen[i]] +=
          coefficients[static_cast<Eigen::Index>(i)];
  };
  add(found.coefficients.head(static_cast<Eigen::Index>(more.basis.size())));

  Term one = model.terms[*source];
  for (Block& block : one.blocks) block.basis.factors.insert(block.basis.factors.begin(), amounts);
  one.name = found.name;
  model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(std::max(place, *source)));
  model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(std::min(place, *source)));
  const std::size_t own = model.terms.size();
  model.terms.push_back(std::move(one));
  fitter.fit(model, 2);
  double best = fitter.log_likelihood(model);
  // Amounts with the curve known, then the rest with the amounts known. Whether something is gained by it.
  const auto in_turn = [&](bool shape) {
    const MotionModel before = model;
    const Factor known = amounts;
    Term changes = found;
    changes.blocks.resize(1);
    const auto n = static_cast<Eigen::Index>(more.basis.size());
    changes.coefficients = Eigen::VectorXd::Zero(n);
    changes.precision = found.precision.head(n).eval();
    changes.blocks.front().basis.factors[1 - which] = curve_of(model.terms[own], 1);
    model.terms.push_back(changes);
    fitter.fit(model, 1);
    add(model.terms.back().coefficients);
    model.terms.pop_back();
    for (Block& block : model.terms[own].blocks) block.basis.factors.front() = amounts;
    if (shape) {
      settle(fitter, model, own);
    } else {
      fitter.fit(model, 1);
    }
    const double now = fitter.log_likelihood(model), gained = now - best;
    if (gained < 0) {
      model = before;
      amounts = known;
    } else {
      best = now;
    }
    return gained > kSettled;
  };
  for (int turn = 0; turn < kMostTurns && in_turn(false);) ++turn;
  refine(fitter, model, own);
  best = fitter.log_likelihood(model);
  in_turn(true);
  if (best > likelihood - kAsGood) {
    about_the_mean(model.terms[own]);
    widen(fitter, model, own);
    return source;
  }
  model = was;
  return std::nullopt;
}

bool rests_on_another(const Term& term) {
  return std::any_of(term.blocks.begin(), term.blocks.end(), [](const Block& block) {
    return std::any_of(block.basis.factors.begin(), block.basis.factors.end(),
                       [](const Factor& factor) { return !factor.known.empty() && factor.plus == 0; });
  });
}

}  // namespace kilotwin::identify
