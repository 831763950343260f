#include "clients/identify/search/change_points.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Instants of the coarsest raster, and steps that one term may get. More instants find steps closer together and cost a
/// column each per target; more steps follow a curve that is smooth.
constexpr std::size_t kMostPoints = 150, kMostSteps = 12;
/// Nat beyond the price of the choice, for a further step; a smaller value adds steps that are chance.
constexpr double kLeastGain = 2;
/// Finest raster of instants. A wheel of 20 mm/s moves by 0.8 mm in this time, about the noise of a tracked position.
/// Finer rasters cost a linearisation each, and no data locate an instant so well.
constexpr double kFinest_s = 0.04;

/// Step columns at chosen points in place of a block's curve, repeated for each target. Known factors stay.
Block stepping(const Block& like, const std::vector<double>& points) {
  Block block{like.target, Basis{like.basis.factors}, like.during};
  Factor& curve = *block.basis.only_open();
  Factor f;
  f.shape = Shape::kAtLeast;
  f.axis = curve.axis;
  f.low = curve.low;
  f.high = curve.high;
  f.points = points;
  curve = f;
  return block;
}
std::vector<Block> stepping(const std::vector<Block>& kinds, const std::vector<double>& at) {
  std::vector<Block> blocks;
  blocks.reserve(kinds.size());
  for (const Block& kind : kinds) blocks.push_back(stepping(kind, at));
  return blocks;
}

struct Picked {
  std::vector<std::size_t> points;
  double evidence = 0;
  Eigen::VectorXd sd;  ///< of columns: by target, then by point
  std::vector<Eigen::Index> columns;
};

/// Selection of steps among candidate points. All targets share one prior scale.
class StepChoice {
 public:
  StepChoice(const ReducedColumns& data, std::size_t points, std::size_t targets)
      : data_(data), points_(points), targets_(targets) {}

  Picked evaluate(const std::vector<std::size_t>& points) const {
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
    // Maximises the evidence over a few prior scales.
    out.evidence = -1e300;
    double size = size_;
    while (size < 4000 * size_) {
      const Eigen::VectorXd sd = Eigen::VectorXd::Constant(score.size(), size);
      const double value = log_evidence(information, score, sd);
      if (!(value <= out.evidence)) {
        out.evidence = value;
        out.sd = sd;
      }
      size *= 3;
    }
    return out;
  }
  /// The best addition, one step or a pulse of two, and its gain minus its price.
  std::pair<std::vector<std::size_t>, double> best_addition(const Picked& picked, double price) const {
    std::pair<std::vector<std::size_t>, double> best{{}, 0};
    std::vector<double> sizes;
    if (picked.points.empty()) {
      double size = size_;
      while (size < 4000 * size_) {
        sizes.push_back(size);
        size *= 3;
      }
    } else {
      sizes = {picked.sd[0]};
    }
    for (const double size : sizes) {
      // Residual information and score, given the chosen steps.
      Eigen::MatrixXd left = data_.information;
      Eigen::VectorXd score = data_.score;
      if (!picked.columns.empty()) {
        Eigen::MatrixXd own = data_.information(picked.columns, picked.columns);
        own.diagonal().array() += 1 / (size * size);
        const Eigen::MatrixXd cross = data_.information(picked.columns, Eigen::all);
        const Eigen::MatrixXd by = own.llt().solve(cross);
        left.noalias() -= cross.transpose() * by;
        score -= by.transpose() * Eigen::VectorXd(data_.score(picked.columns));
      }
      for (const std::size_t width : {0u, 1u, 2u, 4u, 8u}) {
        for (std::size_t p = 0; p + width < points_; ++p) {
          std::vector<Eigen::Index> columns;
          for (std::size_t t = 0; t < targets_; ++t) {
            columns.push_back(static_cast<Eigen::Index>(t * points_ + p));
            if (width > 0) columns.push_back(static_cast<Eigen::Index>(t * points_ + p + width));
          }
          const double gain =
              log_evidence(left(columns, columns), score(columns),
                           Eigen::VectorXd::Constant(static_cast<Eigen::Index>(columns.size()), size)) -
              price * (width > 0 ? 2 : 1);
          if (gain <= best.second) continue;
          best = {{p}, gain};
          if (width > 0) best.first.push_back(p + width);
        }
      }
    }
    return best;
  }
  void set_smallest_size() {
    double most = 0;
    for (Eigen::Index i = 0; i < data_.information.rows(); ++i) most = std::max(most, data_.information(i, i));
    size_ = 1 / std::sqrt(std::max(most, 1e-12));
  }

 private:
  const ReducedColumns& data_;
  std::size_t points_, targets_;
  double size_ = 1;
};

/// Steps with one kind of target, in place of a term or added to it.
struct Steps {
  std::vector<Block> kinds;
  bool beside = false;
  std::vector<double> at_s;
  double gain = 0;  ///< log evidence over the present term, minus the price of the choice
};

/// Selects the steps on a raster whose gain exceeds their price.
void choose_steps(const Fitter& fitter, const FitState& state, std::size_t place, const std::vector<double>& points,
                  Steps& steps) {
  const MotionModel& model = state.model;
  const Term& term = model.terms[place];
  const LocalQuadratic l = local_quadratic(fitter, state, steps.beside ? model.terms.size() : place,
                                           stepping(steps.kinds, points), steps.beside);
  double had = 0;
  Eigen::VectorXd score = l.score;
  if (!steps.beside) {
    score = l.score_without(term.coefficients);
    const ReducedColumns now = reduced_columns(l, score, l.term_columns());
    had = log_evidence(now.information, now.score, term.precision.cwiseInverse().cwiseSqrt());
  }
  const ReducedColumns data = reduced_columns(l, score, l.added_columns());
  StepChoice choice(data, points.size(), steps.kinds.size());
  choice.set_smallest_size();
  const double price = std::log(static_cast<double>(points.size()));
  Picked picked;
  while (picked.points.size() < kMostSteps) {
    const auto [added, gain] = choice.best_addition(picked, price);
    if (added.empty() || gain < kLeastGain) break;
    std::vector<std::size_t> with = picked.points;
    with.insert(with.end(), added.begin(), added.end());
    picked = choice.evaluate(with);
  }
  for (const std::size_t p : picked.points) steps.at_s.push_back(points[p]);
  std::sort(steps.at_s.begin(), steps.at_s.end());
  steps.gain = picked.evidence - price * static_cast<double>(picked.points.size()) - had;
}

/// Complexity of a curve: half the log determinant of its posterior precision relative to the prior.
double bends(const Fitter& fitter, const FitState& state, std::size_t place) {
  const MotionModel& model = state.model;
  const LocalQuadratic l = local_quadratic(fitter, state, place, {});
  const ReducedColumns now = reduced_columns(l, l.score_without(model.terms[place].coefficients), l.term_columns());
  const Eigen::VectorXd sd = model.terms[place].precision.cwiseInverse().cwiseSqrt();
  return -log_evidence(now.information, Eigen::VectorXd::Zero(sd.size()), sd);
}

/// Adds the steps to the model and refines their times on finer rasters. False if their order changes.
bool put_steps(const Fitter& fitter, FitState& state, std::size_t place, const Steps& steps, double apart_s) {
  MotionModel& model = state.model;
  // Points of a finer raster on each side of an instant. A step is a fifth of the last one, so that six reach past the
  // neighbouring points; more points leave fewer steps within kMostColumns.
  constexpr int kSide = 6, kRaster = 2 * kSide + 1;
  const std::size_t home = place;
  std::vector<double> at = steps.at_s;
  if (steps.beside) {
    // A temporary term, merged into the other afterwards.
    model.terms.push_back({model.terms[place].name, {}, {}, {}});
    place = model.terms.size() - 1;
  }
  double fine_s = apart_s / 5;
  while (fine_s > kFinest_s) {
    std::vector<double> raster;
    for (const double t : at)
      for (int i = -kSide; i <= kSide; ++i) raster.push_back(t + i * fine_s);
    if (raster.size() > kMostColumns) return false;
    const LocalQuadratic l = local_quadratic(fitter, state, place, stepping(steps.kinds, raster));
    const Eigen::VectorXd score = l.score_without(model.terms[place].coefficients);
    const ReducedColumns data = reduced_columns(l, score, l.added_columns());
    StepChoice choice(data, raster.size(), steps.kinds.size());
    choice.set_smallest_size();
    std::vector<std::size_t> chosen;
    for (std::size_t k = 0; k < at.size(); ++k) chosen.push_back(kRaster * k + kSide);
    Picked best = choice.evaluate(chosen);
    for (int sweep = 0; sweep < 3; ++sweep) {
      for (std::size_t k = 0; k < at.size(); ++k) {
        for (std::size_t i = 0; i < kRaster; ++i) {
          std::vector<std::size_t> other = best.points;
          other[k] = kRaster * k + i;
          Picked found = choice.evaluate(other);
          if (found.evidence > best.evidence) best = std::move(found);
        }
      }
    }
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = raster[best.points[k]];
    if (!std::is_sorted(at.begin(), at.end())) return false;
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index c : best.columns) columns.push_back(l.own + c);
    replace_blocks(model, place, l, stepping(steps.kinds, at), score, columns, best.sd);
    fine_s /= 5;
  }
  if (!steps.beside) return true;
  const Term own = model.terms.back();
  model.terms.pop_back();
  Term& term = model.terms[home];
  term.blocks.insert(term.blocks.end(), own.blocks.begin(), own.blocks.end());
  Eigen::VectorXd all(term.coefficients.size() + own.coefficients.size()), precision(all.size());
  all << term.coefficients, own.coefficients;
  precision << term.precision, own.precision;
  term.coefficients = all;
  term.precision = precision;
  return true;
}

/// Price of steps: the choices of their times, and their sizes.
double price_of(const Steps& steps, std::size_t points) {
  return (std::log(static_cast<double>(points)) + 3 * static_cast<double>(steps.kinds.size())) *
         static_cast<double>(steps.at_s.size());
}

/// Where steps may be.
struct StepRaster {
  Basis like;
  const std::vector<double>& points;
  double apart_s;
};

/// Whether all blocks act on targets of the groups, and depend on time or on nothing, at least one of them on time.
bool is_over_time(const Term& term, std::initializer_list<const TargetGroup*> groups) {
  bool over_time = false;
  for (const Block& block : term.blocks) {
    const bool of_groups = std::any_of(groups.begin(), groups.end(), [&](const TargetGroup* group) {
      return std::find(group->targets.begin(), group->targets.end(), block.target) != group->targets.end();
    });
    const bool of_time = std::all_of(block.basis.factors.begin(), block.basis.factors.end(),
                                     [](const Factor& f) { return f.axis.of == Covariate::kTime && !f.of_two(); });
    if (!of_groups || !of_time) return false;
    over_time = over_time || !block.basis.factors.empty();
  }
  return over_time;
}

/// Tries steps of the camera in place of a drift in the world, or the other way round. Contacts show which of the two moves: walls and
/// contact noise that were fitted without the effect would decide at random, so both get their own. `cost`: of the term as it is.
/// Returns whether the steps took its place.
bool became_other_motion(const Fitter& fitter, FitState& state, std::size_t place, double cost, bool in_world,
                         const StepRaster& raster) {
  constexpr double kSurely = 3;  // nat, a Bayes factor of 20: with less, the motion stays as it was found
  Steps steps;
  for (const Target target :
       in_world ? std::array{Target::kMeasuredX, Target::kMeasuredY} : std::array{Target::kWorldX, Target::kWorldY})
    steps.kinds.push_back({target, raster.like, in_world ? kAlways : kDriven});
  choose_steps(fitter, state, place, raster.points, steps);
  FitState other = state;
  if (steps.at_s.empty() || !put_steps(fitter, other, place, steps, raster.apart_s)) return false;
  other.model.terms[place].name = effect_name(in_world ? kCamera : kWorld, "time");
  double rise = fitter.fit_for_likelihood(other, 2);
  FitState own = state;
  if (state.model.walls.any()) {
    for (FitState* const one : {&own, &other}) {
      fitter.fit_contacts(*one);
      fitter.fit_until_settled(*one);
    }
    rise = fitter.log_likelihood_of_all(other) - fitter.log_likelihood_of_all(own);
  } else {
    rise -= fitter.log_likelihood(own);
  }
  const bool better = rise + cost - price_of(steps, raster.points.size()) > kSurely;
  state = better ? std::move(other) : std::move(own);
  return better;
}

}  // namespace

bool only_rises(const Axis& axis) {
  switch (axis.of) {
    case Covariate::kTime:
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kMotorTimeSum:
    case Covariate::kDrivenTime:
    case Covariate::kCommandCount: return axis.decay_index == 0;
    default: return false;
  }
}

bool is_drift_over_time(const Term& term) { return is_over_time(term, {&kWorld}); }

bool is_camera_over_time(const Term& term) { return is_over_time(term, {&kCamera, &kCameraPose}); }

std::string find_change_points(const Fitter& fitter, FitState& state, std::size_t place) {
  const MotionModel& model = state.model;
  std::string name = model.terms[place].name;
  double duration_s = 0;
  bool product = false;
  std::vector<Block> kinds;
  for (const Block& block : model.terms[place].blocks) {
    const Factor* const curve = block.basis.only_open();
    if (curve == nullptr || (block.basis.factors.size() != 1 && curve != &block.basis.factors.back())) return name;
    // Rotations and scale changes of the image belong to calibration_shifts.hpp.
    if (block.target == Target::kMeasuredTurn || block.target == Target::kMeasuredScale) return name;
    const Factor& f = *curve;
    product = product || block.basis.factors.size() > 1;
    if (!only_rises(f.axis) || f.shape != Shape::kCosines) return name;
    duration_s = std::max(duration_s, f.high);
    if (std::none_of(kinds.begin(), kinds.end(),
                     [&](const Block& b) { return b.target == block.target && b.during == block.during; }))
      kinds.push_back(block);
  }
  std::vector<double> points;
  const double apart_s = std::max(1.0, duration_s / kMostPoints);
  double at = apart_s;
  while (at < duration_s - apart_s / 2 && points.size() < kMostPoints) {
    points.push_back(at);
    at += apart_s;
  }
  std::vector<Steps> forms = {{kinds, false, {}, 0}};
  if (product) {
    // A curve of a product has a constant, as has a step before all data.
    points.insert(points.begin(), -2 * apart_s);
  } else {
    forms.push_back({kinds, true, {}, 0});
  }
  // On the raster the gain is approximate. The decision follows after the refinement.
  FitState best = state;
  double best_gain = 0, best_cost = NAN;
  struct Known {
    double log_likelihood, bends;
  };
  std::optional<Known> had;  // of the state as it was
  for (Steps& form : forms) {
    // Nat, on the raster: forms with less are not refined; a smaller value costs a fit for each of them.
    constexpr double kBetter = 2;
    choose_steps(fitter, state, place, points, form);
    if (form.at_s.empty() || form.gain < kBetter) continue;
    FitState trial = state;
    if (!put_steps(fitter, trial, place, form, apart_s)) continue;
    double likelihood = fitter.fit_for_likelihood(trial, 2);
    if (form.beside) {
      refit(fitter, trial, place);
      likelihood = fitter.log_likelihood(trial);
    }
    if (!had) had = Known{fitter.log_likelihood(state), bends(fitter, state, place)};
    const double cost = price_of(form, points.size()) + (form.beside ? had->bends : 0),
                 gain = likelihood - had->log_likelihood + had->bends - cost;
    if (gain <= best_gain) continue;
    best_gain = gain;
    best_cost = cost;
    best = std::move(trial);
  }
  state = std::move(best);
  // A displacement in the world and one of the camera look alike until the instant is known.
  const Block& acting = kinds.front();
  const bool in_world = acting.target == Target::kWorldX || acting.target == Target::kWorldY;
  if (product || acting.basis.only_open()->axis.of != Covariate::kTime ||
      (!in_world && acting.target != Target::kMeasuredX))
    return name;
  if (std::isnan(best_cost)) best_cost = bends(fitter, state, place);
  (void)became_other_motion(fitter, state, place, best_cost, in_world, {acting.basis, points, apart_s});
  return model.terms[place].name;
}

}  // namespace kilotwin::identify
