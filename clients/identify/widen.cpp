#include "clients/identify/widen.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "clients/identify/linear.hpp"
#include "clients/identify/refine.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Log evidence that one more thing that a cause does must bring.
constexpr double kWorth = 10;
constexpr int kMostWidened = 3;

/// The same covariates with fewer columns: for what is only to be found.
Basis modest(Basis basis) {
  for (Factor& f : basis.factors) {
    if (f.shape == Shape::kAtLeast || f.shape == Shape::kTable) continue;
    basis.chosen.clear();
    if (f.shape == Shape::kCosines)
      f.count = std::min<std::uint32_t>(f.count, f.axis.of == Covariate::kTime ? 24 : 12);
    if (f.shape == Shape::kCosines2) f.count = std::min<std::uint32_t>(f.count, 6);
    if (f.shape == Shape::kHarmonics) f.count = std::min<std::uint32_t>(f.count, 4);
  }
  return basis;
}

/// One more thing that a cause may do.
struct Widening {
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

std::vector<Widening> widenings_of(const Term& term, bool headings) {
  const Block& first = term.blocks.front();
  const Basis basis = modest(first.basis);
  std::vector<Widening> all;
  if (is_measured(first.target)) {
    if (headings && !acts(term, Target::kMeasuredHeading, kAlways))
      all.push_back({{{Target::kMeasuredHeading, basis, kAlways}}});
    if (basis.looks_at(Covariate::kX) || first.target != Target::kMeasuredX) return all;
    // A turn of the picture about any point.
    const auto along = [&](Covariate of) {
      Basis product = basis;
      if (!product.chosen.empty()) return Basis{};
      Factor f;
      f.axis.of = of;
      f.low = -1000;
      f.high = 1000;
      product.factors.push_back(f);
      return product;
    };
    if (basis.chosen.empty())
      all.push_back({{{Target::kMeasuredX, along(Covariate::kY), kAlways},
                      {Target::kMeasuredY, along(Covariate::kX), kAlways}}});
    return all;
  }
  if (is_world(first.target)) {
    constexpr std::uint8_t kAtRest = 1;
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
    all.push_back({{{target, basis, first.during}}});
  }
  return all;
}

/// Columns of steps at chosen points of a block, one set after the other of all targets.
Block stepping(const Block& like, const std::vector<double>& points) {
  Factor f;
  f.shape = Shape::kAtLeast;
  f.axis.of = Covariate::kTime;
  f.points = points;
  return {like.target, Basis{{f}}, like.during};
}

struct Picked {
  std::vector<std::size_t> points;
  double evidence = 0;
  Eigen::VectorXd sd;  ///< of columns: by target, then by point
  std::vector<Eigen::Index> columns;
};

/// Steps at some of the points, all targets of one size each.
class StepChoice {
 public:
  StepChoice(const Beside& data, std::size_t points, std::size_t targets)
      : data_(data), points_(points), targets_(targets) {}

  Picked weigh(const std::vector<std::size_t>& points) const {
    Picked out;
    out.points = points;
    ColumnGroup group;
    for (std::size_t t = 0; t < targets_; ++t) {
      for (const std::size_t p : points) {
        out.columns.push_back(static_cast<Eigen::Index>(t * points_ + p));
        group.columns.push_back(static_cast<Eigen::Index>(out.columns.size()) - 1);
        group.roughness.push_back(0);
      }
    }
    const Eigen::MatrixXd information = data_.information(out.columns, out.columns);
    const Eigen::VectorXd score = data_.score(out.columns);
    // One size for all, by the golden rule of thumb: of a few, the one that fits best.
    out.evidence = -1e300;
    for (double size = size_; size < 4000 * size_; size *= 3) {
      const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
      const double value = log_evidence(information, score, sd);
      if (value <= out.evidence) continue;
      out.evidence = value;
      out.sd = sd;
    }
    return out;
  }
  void set_smallest_size() {
    double most = 0;
    for (Eigen::Index i = 0; i < data_.information.rows(); ++i) most = std::max(most, data_.information(i, i));
    size_ = 1 / std::sqrt(std::max(most, 1e-12));
  }

 private:
  const Beside& data_;
  std::size_t points_, targets_;
  double size_ = 1;
};

}  // namespace

void widen(const Fitter& fitter, MotionModel& model, std::size_t place) {
  for (int widened = 0; widened < kMostWidened; ++widened) {
    const std::vector<Widening> all = widenings_of(model.terms[place], fitter.set().set().has_headings);
    if (all.empty()) return;
    std::vector<Block> blocks;
    for (const Widening& w : all) blocks.insert(blocks.end(), w.blocks.begin(), w.blocks.end());
    const Linear l = linear(fitter, model, model.terms.size(), blocks, true);
    double best = kWorth;
    const Widening* chosen = nullptr;
    Eigen::VectorXd chosen_sd;
    Eigen::Index next = l.own;
    for (const Widening& w : all) {
      std::vector<Eigen::Index> columns(static_cast<std::size_t>(w.size()));
      std::iota(columns.begin(), columns.end(), next);
      next += w.size();
      const Beside data = beside(l, l.score, columns);
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
    const MotionModel was = model;
    const double likelihood = fitter.log_likelihood(model);
    Term& term = model.terms[place];
    term.blocks.insert(term.blocks.end(), chosen->blocks.begin(), chosen->blocks.end());
    const Eigen::Index had = term.coefficients.size();
    term.coefficients.conservativeResize(had + chosen->size());
    term.coefficients.tail(chosen->size()).setZero();
    term.precision.conservativeResize(had + chosen->size());
    term.precision.tail(chosen->size()) = chosen_sd.array().square().inverse();
    fitter.fit(model, 2);
    if (fitter.log_likelihood(model) > likelihood + kWorth) continue;
    model = was;
    return;
  }
}

void find_steps(const Fitter& fitter, MotionModel& model, std::size_t place) {
  double duration_s = 0;
  std::vector<Block> kinds;
  for (const Block& block : model.terms[place].blocks) {
    if (block.basis.factors.size() != 1) return;
    const Factor& f = block.basis.factors.front();
    if (f.axis.of != Covariate::kTime || (f.shape != Shape::kCosines && f.shape != Shape::kAtLeast)) return;
    duration_s = std::max(duration_s, f.shape == Shape::kCosines ? f.high : f.points.back());
    if (std::none_of(kinds.begin(), kinds.end(),
                     [&](const Block& b) { return b.target == block.target && b.during == block.during; }))
      kinds.push_back(block);
  }
  constexpr std::size_t kMostPoints = 150, kMostSteps = 16;
  std::vector<double> points;
  const double apart_s = std::max(1.0, duration_s / kMostPoints);
  for (double at = apart_s; at < duration_s - apart_s / 2 && points.size() < kMostPoints; at += apart_s)
    points.push_back(at);
  const auto stepped = [&](const std::vector<double>& at) {
    std::vector<Block> blocks;
    for (const Block& kind : kinds) blocks.push_back(stepping(kind, at));
    return blocks;
  };
  MotionModel trial = model;
  const Linear l = linear(fitter, trial, place, stepped(points));
  const Eigen::VectorXd at_zero = l.score_without(trial.terms[place].coefficients);
  const Beside now = beside(l, at_zero, l.of_term()), data = beside(l, at_zero, l.more());
  const double had =
      log_evidence(now.information, now.score, trial.terms[place].precision.cwiseInverse().cwiseSqrt());
  StepChoice choice(data, points.size(), kinds.size());
  choice.set_smallest_size();
  Picked picked;
  const double price = std::log(static_cast<double>(points.size()));
  while (picked.points.size() < kMostSteps) {
    Picked best;
    double gain = 2;
    // A step, or two that make a pulse.
    for (const std::size_t width : {0u, 1u, 2u, 4u, 8u}) {
      for (std::size_t p = 0; p + width < points.size(); ++p) {
        std::vector<std::size_t> with = picked.points;
        with.push_back(p);
        if (width > 0) with.push_back(p + width);
        Picked found = choice.weigh(with);
        const double worth =
            found.evidence - picked.evidence - price * static_cast<double>(with.size() - picked.points.size());
        if (worth <= gain) continue;
        gain = worth;
        best = std::move(found);
      }
    }
    if (best.points.empty()) break;
    picked = std::move(best);
  }
  if (picked.points.empty()) return;
  constexpr double kBetter = 2;
  if (picked.evidence - price * static_cast<double>(picked.points.size()) < had + kBetter) return;
  std::vector<double> at;
  for (const std::size_t p : picked.points) at.push_back(points[p]);
  std::sort(at.begin(), at.end());
  const double likelihood = fitter.log_likelihood(model);
  // Twice about each step a finer raster.
  for (double fine_s = apart_s / 5; fine_s > 0.04; fine_s /= 5) {
    std::vector<double> raster;
    for (const double t : at)
      for (int i = -6; i <= 6; ++i) raster.push_back(t + i * fine_s);
    if (raster.size() > kMostColumns) break;
    const Linear fine = linear(fitter, trial, place, stepped(raster));
    const Eigen::VectorXd zero = fine.score_without(trial.terms[place].coefficients);
    const Beside fine_data = beside(fine, zero, fine.more());
    StepChoice fine_choice(fine_data, raster.size(), kinds.size());
    fine_choice.set_smallest_size();
    std::vector<std::size_t> chosen;
    for (std::size_t k = 0; k < at.size(); ++k) chosen.push_back(13 * k + 6);
    Picked best = fine_choice.weigh(chosen);
    for (int sweep = 0; sweep < 3; ++sweep) {
      for (std::size_t k = 0; k < at.size(); ++k) {
        for (std::size_t i = 0; i < 13; ++i) {
          std::vector<std::size_t> other = best.points;
          other[k] = 13 * k + i;
          Picked found = fine_choice.weigh(other);
          if (found.evidence > best.evidence) best = std::move(found);
        }
      }
    }
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = raster[best.points[k]];
    if (!std::is_sorted(at.begin(), at.end())) return;
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index c : best.columns) columns.push_back(fine.own + c);
    exchange(trial, place, fine, stepped(at), zero, columns, best.sd);
  }
  if (trial.terms[place].blocks.front().basis.factors.front().shape != Shape::kAtLeast) return;
  fitter.fit(trial, 2);
  if (fitter.log_likelihood(trial) > likelihood - 0.5 * static_cast<double>(now.score.size())) model = trial;
}

}  // namespace kilotwin::identify
