#include "clients/identify/search/target_extension.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Least gain in log evidence of one more target.
constexpr double kLeastGain = 10;
constexpr int kMostExtensions = 3;

/// The same covariates with fewer columns, which suffice for detection.
Basis modest(Basis basis) {
  for (Factor& f : basis.factors) {
    if (f.shape == Shape::kAtLeast || f.shape == Shape::kTable || !f.known.empty()) continue;
    basis.chosen.clear();
    if (f.shape == Shape::kGrid) {
      f.shape = Shape::kCosines2;
      f.count = 6;
      f.points.clear();
    }
    if (f.shape == Shape::kCosines)
      f.count = std::min<std::uint32_t>(f.count, f.axis.of == Covariate::kTime ? 24 : 12);
    if (f.shape == Shape::kCosines2) f.count = std::min<std::uint32_t>(f.count, 6);
    if (f.shape == Shape::kPolynomials2) f.count = std::min<std::uint32_t>(f.count, 4);
    if (f.shape == Shape::kHarmonics) f.count = std::min<std::uint32_t>(f.count, 4);
  }
  // Fewer columns for products.
  constexpr std::size_t kMost = 40;
  if (basis.factors.size() > 1 && basis.chosen.empty()) {
    for (Factor& f : basis.factors)
      if (f.shape == Shape::kCosines && f.known.empty() && basis.size() > kMost)
        f.count = std::max(1u, static_cast<std::uint32_t>(kMost * f.count / basis.size()));
  }
  return basis;
}

/// One further target of an effect.
struct Extension {
  std::vector<Block> blocks;
  [[nodiscard]] Eigen::Index size() const {
    Eigen::Index n = 0;
    for (const Block& block : blocks) n += static_cast<Eigen::Index>(block.basis.size());
    return n;
  }
};

bool acts(const Term& term, Target target, std::uint8_t during) {
  return std::any_of(term.blocks.begin(), term.blocks.end(), [&](const Block& b) {
    return b.target == target && (is_measured(target) || (b.during & during) == during);
  });
}

bool is_world(Target t) { return t == Target::kWorldX || t == Target::kWorldY; }

/// A one-sided effect of all robots is confounded with the mean of their biases, so it needs a constant.
bool is_one_sided(Target t) { return t == Target::kGainLeft || t == Target::kGainRight || t == Target::kTurn; }

void with_constant(Basis& basis) {
  if (basis.factors.size() == 1 && basis.factors.front().shape == Shape::kCosines && basis.chosen.empty() &&
      basis.factors.front().known.empty())
    basis.factors.front().first = 0;
}

/// Headings that are measured in a bent picture. To first order, a heading h is off by
///   a(x, y) + b(x, y) cos 2h + c(x, y) sin 2h
/// with maps that follow from the derivatives of the distortion.
Extension bent_directions(const Factor& map) {
  Factor place = map;
  place.known.clear();
  place.count = std::min<std::uint32_t>(place.count, 4);
  Factor twice;
  twice.shape = Shape::kHarmonics;
  twice.axis.of = Covariate::kHeading;
  twice.first = 2;
  twice.count = 1;
  return {{{Target::kMeasuredHeading, Basis{{place}}, kAlways},
           {Target::kMeasuredHeading, Basis{{twice}}, kAlways},
           {Target::kMeasuredHeading, Basis{{place, twice}}, kAlways}}};
}

std::vector<Extension> extensions_of(const Term& term, bool headings) {
  const Block& first = term.blocks.front();
  const Basis basis = modest(first.basis);
  std::vector<Extension> all;
  if (is_measured(first.target)) {
    if (headings && !acts(term, Target::kMeasuredHeading, kAlways)) {
      all.push_back({{{Target::kMeasuredHeading, basis, kAlways}}});
      if (const Factor* const map = basis.only_open(); map != nullptr && basis.factors.size() == 1 && map->of_two())
        all.push_back(bent_directions(*map));
    }
    if (basis.looks_at(Covariate::kX) || first.target != Target::kMeasuredX) return all;
    // A camera that shifts may also rotate and change its scale.
    for (const Target target : {Target::kMeasuredTurn, Target::kMeasuredScale})
      if (!acts(term, target, kAlways)) all.push_back({{{target, basis, kAlways}}});
    return all;
  }
  if (is_world(first.target)) {
    constexpr std::uint8_t kAtRest = 1;  // bit of the command 0, stop
    if (!acts(term, first.target, kAtRest))
      all.push_back({{{Target::kWorldX, basis, kAtRest}, {Target::kWorldY, basis, kAtRest}}});
    return all;
  }
  for (const Target target :
       {Target::kGain, Target::kGainLeft, Target::kGainRight, Target::kTurn, Target::kAhead, Target::kSideways}) {
    if (acts(term, target, first.during)) continue;
    if (target == Target::kGain &&
        (acts(term, Target::kGainLeft, kDriven) || acts(term, Target::kGainRight, kDriven)))
      continue;
    Extension& more = all.emplace_back(Extension{{{target, basis, first.during}}});
    if (is_one_sided(target)) with_constant(more.blocks.front().basis);
  }
  return all;
}

}  // namespace

void extend_targets(const Fitter& fitter, FitState& state, std::size_t place) {
  if (state.model.terms[place].general) return;
  for (int extended = 0; extended < kMostExtensions; ++extended) {
    const std::vector<Extension> all = extensions_of(state.model.terms[place], state.tracks.set().has_headings);
    if (all.empty()) return;
    std::vector<Block> blocks;
    for (const Extension& w : all) blocks.insert(blocks.end(), w.blocks.begin(), w.blocks.end());
    const LocalQuadratic l = local_quadratic(fitter, state, state.model.terms.size(), blocks, true);
    double best = kLeastGain;
    const Extension* chosen = nullptr;
    Eigen::VectorXd chosen_sd;
    Eigen::Index next = l.own;
    for (const Extension& w : all) {
      std::vector<Eigen::Index> columns(static_cast<std::size_t>(w.size()));
      std::iota(columns.begin(), columns.end(), next);
      next += w.size();
      const ReducedColumns data = reduced_columns(l, l.score, columns);
      ColumnGroup group;
      for (const Block& block : w.blocks)
        for (const double rough : block.basis.roughness()) {
          group.columns.push_back(static_cast<Eigen::Index>(group.columns.size()));
          group.roughness.push_back(rough);
        }
      std::vector<Smoothness> smoothness;
      Eigen::VectorXd sd;
      const double evidence = choose_smoothness(data.information, data.score, {group}, smoothness, sd);
      if (evidence <= best) continue;
      best = evidence;
      chosen = &w;
      chosen_sd = sd.cwiseMax(1e-6 * std::max(sd.maxCoeff(), 1e-6));
    }
    if (chosen == nullptr) return;
    FitState trial = state;
    Term& term = trial.model.terms[place];
    term.blocks.insert(term.blocks.end(), chosen->blocks.begin(), chosen->blocks.end());
    const Eigen::Index had = term.coefficients.size();
    term.coefficients.conservativeResize(had + chosen->size());
    term.coefficients.tail(chosen->size()).setZero();
    term.precision.conservativeResize(had + chosen->size());
    term.precision.tail(chosen->size()) = chosen_sd.array().square().inverse();
    if (fitter.fit_for_likelihood(trial, 2) <= fitter.log_likelihood(state) + kLeastGain) return;
    state = std::move(trial);
  }
}

}  // namespace kilotwin::identify
