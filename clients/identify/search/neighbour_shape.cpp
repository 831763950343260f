#include "clients/identify/search/neighbour_shape.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Least gain in log evidence of one more form, in addition to the choice penalty.
constexpr double kLeastEvidence = 8;
constexpr std::size_t kMostForms = 5;
/// Forms chosen in the first round: the quadratic approximation is inaccurate far from its centre.
constexpr std::size_t kFirstForms = 2;
constexpr std::size_t kMostCounted = 6;
/// Radii within which the density hardly ever exceeds this have no sums: it is that of one robot at 88 % of the radius.
/// Smaller values admit radii over which sums have next to no range.
constexpr double kLeastDensity = 0.05;
/// Range of the prior's scale, in units of the target: of a gain, from 0.4 % to several times the speed. The evidence
/// has its maximum between; a wider range costs time only.
constexpr double kSmallestScale = 0.004, kMostScale = 8;

/// Indices in kNeighbourRadii_mm (50, 70, 80, 100, 120, 150 mm) of directional sums.
constexpr std::array<std::uint8_t, 6> kDirected = {1, 3, 4, 6, 8, 11};
/// Exponents of the directional weight: from a half circle to a beam of about 45 degrees.
constexpr std::array<std::uint8_t, 2> kFoci = {1, 4};

/// Whether a block depends on neighbours only.
bool is_of_neighbours(const Block& block) {
  const auto neighbours = [](const Factor& f) { return f.known.empty() && is_of_others(f.axis); };
  const std::vector<Factor>& factors = block.basis.factors;
  return (block.target == Target::kGain || block.target == Target::kAhead || block.target == Target::kTurn ||
          block.target == Target::kSideways) &&
         !factors.empty() && std::all_of(factors.begin(), factors.end(), neighbours);
}

/// The 99.9th percentile of the density within each radius.
std::array<double, kNeighbourRadii_mm.size()> densities(const PreparedSet& set) {
  std::array<std::vector<float>, kNeighbourRadii_mm.size()> all;
  // Raster of the density; a finer one costs time, a coarser one leaves few values for the percentile.
  constexpr double kEvery_s = 3;
  for (const TrackView& view : set.views()) {
    double t = view.track->samples.front().time_s;
    while (t < view.track->samples.back().time_s) {
      for (std::size_t r = 0; r < all.size(); ++r)
        all[r].push_back(view.neighbours->view(view.place, t).density[r]);
      t += kEvery_s;
    }
  }
  std::array<double, kNeighbourRadii_mm.size()> most{};
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (!all[r].empty()) most[r] = stats::upper_end(all[r], all[r].size() / 1000);
  }
  return most;
}

Axis toward(Covariate of, std::uint8_t radius, std::uint8_t focus, int degrees) {
  Axis axis{of, radius};
  axis.focus = focus;
  axis.toward_deg = static_cast<std::int16_t>(degrees);
  return axis;
}

/// A saturating function extrapolates sensibly to more neighbours. It is 0 without neighbours: a constant would be
/// confounded with the base speeds.
Factor levelling(Axis axis) {
  Factor f;
  f.shape = Shape::kLevelling;
  f.axis = axis;
  f.points = {0.3, 1, 3};
  return f;
}

/// One candidate shape.
using Form = std::vector<Block>;

/// Distance and direction of the nearest.
Basis nearest(std::uint8_t radius, std::uint32_t distances, std::uint32_t waves) {
  Factor near, bearing;
  near.shape = Shape::kTaper;
  near.axis = {Covariate::kNearest, radius};
  near.high = kNeighbourRadii_mm[radius];
  near.count = distances;
  bearing.shape = Shape::kHarmonics;
  bearing.axis = {Covariate::kBearing, radius};
  bearing.count = waves;
  return {{near, bearing}};
}

std::vector<Form> forms_of_speed(const PreparedSet& set, std::uint8_t during) {
  std::vector<Form> forms;
  const auto most = densities(set);
  const auto add = [&](Factor f) { forms.push_back({{Target::kGain, Basis{{std::move(f)}}, during}}); };
  constexpr std::uint8_t kCount = kNeighbourRadii_mm.size();
  for (std::uint8_t r = 0; r < kCount; ++r) {
    Factor table;
    table.shape = Shape::kAtLeast;
    table.axis = {Covariate::kNeighbours, r};
    for (std::size_t n = 1; n <= kMostCounted; ++n) table.points.push_back(static_cast<double>(n));
    if (r > 0) add(table);
    if (most[r] < kLeastDensity) continue;
    Factor sum;
    sum.axis = {Covariate::kDensity, r};
    sum.high = most[r];
    add(sum);
    add(levelling(sum.axis));
    Factor near;
    near.shape = Shape::kTaper;
    near.axis = {Covariate::kNearest, r};
    near.high = kNeighbourRadii_mm[r];
    near.count = 4;
    if (r > 0) add(near);
  }
  // Directional sums: ahead, or behind.
  for (const std::uint8_t r : kDirected) {
    if (most[r] < kLeastDensity) continue;
    for (const Covariate of : {Covariate::kNeighbours, Covariate::kDensity})
      for (const std::uint8_t focus : kFoci)
        for (const int degrees : {0, 180}) add(levelling(toward(of, r, focus, degrees)));
  }
  // Distance and direction of the nearest within 60, 80 and 110 mm.
  for (const std::uint8_t r : std::array<std::uint8_t, 3>{2, 4, 7}) {
    forms.push_back({{Target::kGain, nearest(r, 2, 2), during}});
    forms.push_back({{Target::kAhead, nearest(r, 2, 1), during}});
  }
  return forms;
}

/// Forms of effects that turn robots or push them sideways.
std::vector<Form> forms_of_push(const PreparedSet& set, bool turns, std::uint8_t during) {
  std::vector<Form> forms;
  const auto most = densities(set);
  const auto targets = turns ? std::vector{Target::kTurn} : std::vector{Target::kAhead, Target::kSideways};
  const auto linear = [&](Axis axis) {
    Factor f;
    f.axis = axis;
    f.high = axis.of == Covariate::kDensity ? most[axis.radius] : kMostCounted;
    return Basis{{f}};
  };
  const auto add = [&](Covariate of, std::uint8_t radius, std::uint8_t focus,
                       std::initializer_list<int> directions) {
    Form form;
    for (const Target target : targets)
      for (const int degrees : directions)
        form.push_back({target, linear(toward(of, radius, focus, degrees)), during});
    forms.push_back(std::move(form));
  };
  for (const std::uint8_t r : kDirected) {
    if (most[r] < kLeastDensity) continue;
    for (const Covariate of : {Covariate::kNeighbours, Covariate::kDensity}) {
      // Angular harmonics one to three of the nearest's direction.
      if (turns)
        add(of, r, 1, {-90, 90});
      else
        add(of, r, 1, {-90, 0, 90, 180});
      add(of, r, 4, {-135, -45, 45, 135});
    }
    Form by_nearest, of_all;
    for (const Target target : targets) {
      by_nearest.push_back({target, nearest(r, 3, 2), during});
      // For any direction.
      of_all.push_back({target, linear({Covariate::kDensity, r}), during});
    }
    forms.push_back(std::move(by_nearest));
    forms.push_back(std::move(of_all));
  }
  return forms;
}

/// The same forms with continuous radii around the present ones, and with wider and narrower directions.
std::vector<Form> with_reach_about(const std::vector<Form>& forms) {
  // Reach of the search about a radius, nearly the distance to the next one in kNeighbourRadii_mm, and bounds of a
  // direction's focus. Wider ones cost a column per form.
  constexpr int kAbout_mm = 9, kLeastFocus = 1, kMostFocus = 12;
  std::vector<Form> out;
  for (const Form& form : forms) {
    for (int by_mm = -kAbout_mm; by_mm <= kAbout_mm; ++by_mm) {
      Form other = form;
      bool listed = true;
      for (Block& block : other) {
        for (Factor& f : block.basis.factors) {
          const double reach = reach_mm(f.axis) + by_mm;
          listed = listed && reach <= kListed_mm;
          f.axis.within_mm = static_cast<float>(reach);
          if (f.shape == Shape::kTaper) f.high = reach;
        }
      }
      if (listed) out.push_back(std::move(other));
    }
    for (const int by : {-2, -1, 1, 2, 4}) {
      Form other = form;
      bool directed = true;
      for (Block& block : other) {
        for (Factor& f : block.basis.factors) {
          const int focus = f.axis.focus + by;
          directed = directed && f.axis.focus > 0 && focus >= kLeastFocus && focus <= kMostFocus;
          f.axis.focus = static_cast<std::uint8_t>(std::max(0, focus));
        }
      }
      if (directed) out.push_back(std::move(other));
    }
  }
  return out;
}

/// The forms with neighbours of which only some count. Radii beyond the list of neighbours are left out.
std::vector<Form> of_some(const std::vector<Form>& forms, const Axis& like) {
  if (!is_of_some(like)) return forms;
  std::vector<Form> out;
  for (Form form : forms) {
    bool listed = true;
    for (Block& block : form) {
      for (Factor& f : block.basis.factors) {
        listed = listed && reach_mm(f.axis) <= kListed_mm;
        f.axis.others = like.others;
        f.axis.only_robot = like.only_robot;
        // One robot counts once.
        if (like.only_robot > 0 && f.shape == Shape::kAtLeast) f.points.resize(1);
      }
    }
    if (listed) out.push_back(std::move(form));
  }
  return out;
}

/// Whether the neighbours that count are the same in all blocks.
bool are_of_the_same(const std::vector<Block>& blocks) {
  const Axis& first = blocks.front().basis.factors.front().axis;
  return std::all_of(blocks.begin(), blocks.end(), [&](const Block& block) {
    return std::all_of(block.basis.factors.begin(), block.basis.factors.end(), [&](const Factor& f) {
      return f.axis.others == first.others && f.axis.only_robot == first.only_robot;
    });
  });
}

/// Selected forms, and the prior standard deviations of their columns.
struct Chosen {
  std::vector<std::size_t> forms;
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd sd;
  double evidence = 0;
};

class Choice {
 public:
  Choice(const ReducedColumns& data, const std::vector<Form>& forms) : data_(data) {
    Eigen::Index next = 0;
    for (const Form& form : forms) {
      std::vector<Eigen::Index> columns;
      std::vector<double> sd;
      for (const Block& block : form) {
        for (const double rough : block.basis.roughness()) {
          sd.push_back(std::pow(rough, -1.5));
          columns.push_back(next++);
        }
      }
      columns_.push_back(std::move(columns));
      sd_.emplace_back(Eigen::Map<Eigen::VectorXd>(sd.data(), static_cast<Eigen::Index>(sd.size())));
    }
  }

  Chosen choose(std::size_t most_forms) const {
    Chosen chosen;
    if (columns_.empty()) return chosen;
    const double price = std::log(static_cast<double>(columns_.size()));
    while (chosen.forms.size() < most_forms) {
      // Residual information and score, given the selected forms.
      Eigen::MatrixXd left = data_.information;
      Eigen::VectorXd score = data_.score;
      if (!chosen.columns.empty()) {
        Eigen::MatrixXd own = data_.information(chosen.columns, chosen.columns);
        own.diagonal() += chosen.sd.array().square().inverse().matrix();
        const Eigen::MatrixXd cross = data_.information(chosen.columns, Eigen::all);
        const Eigen::MatrixXd by = own.llt().solve(cross);
        left.noalias() -= cross.transpose() * by;
        score -= by.transpose() * Eigen::VectorXd(data_.score(chosen.columns));
      }
      double best = 0;
      std::size_t best_form = columns_.size();
      Eigen::VectorXd best_sd;
      for (std::size_t f = 0; f < columns_.size(); ++f) {
        if (std::find(chosen.forms.begin(), chosen.forms.end(), f) != chosen.forms.end()) continue;
        const Eigen::MatrixXd information = left(columns_[f], columns_[f]);
        const Eigen::VectorXd own_score = score(columns_[f]);
        double size = kSmallestScale;
        while (size < kMostScale) {
          const double value = log_evidence(information, own_score, size * sd_[f]);
          if (!(value <= best)) {
            best = value;
            best_form = f;
            best_sd = size * sd_[f];
          }
          size *= 2;
        }
      }
      if (best < kLeastEvidence + price) break;
      chosen.forms.push_back(best_form);
      chosen.columns.insert(chosen.columns.end(), columns_[best_form].begin(), columns_[best_form].end());
      const Eigen::Index had = chosen.sd.size();
      chosen.sd.conservativeResize(had + best_sd.size());
      chosen.sd.tail(best_sd.size()) = best_sd;
      chosen.evidence += best - price;
    }
    return chosen;
  }

 private:
  const ReducedColumns& data_;
  std::vector<std::vector<Eigen::Index>> columns_;
  std::vector<Eigen::VectorXd> sd_;  ///< of the columns of a form, before scaling
};

}  // namespace

bool refine_neighbour_shape(const Fitter& fitter, FitState& state, std::size_t place) {
  const std::vector<Block>& had = state.model.terms[place].blocks;
  if (had.empty() || !std::all_of(had.begin(), had.end(), is_of_neighbours)) return false;
  const bool pushes = had.front().target == Target::kTurn || had.front().target == Target::kSideways;
  if (!are_of_the_same(had)) return false;
  std::vector<Form> forms =
      of_some(pushes ? forms_of_push(state.tracks, had.front().target == Target::kTurn, had.front().during)
                     : forms_of_speed(state.tracks, had.front().during),
              had.front().basis.factors.front().axis);
  double likelihood = fitter.log_likelihood(state);
  // Replaces the term by some of the forms if the gain exceeds `least_gain`.
  const auto try_forms = [&](const std::vector<Form>& of, std::size_t most, double least_gain) {
    // Robots that stay apart have no neighbours within any radius, and refined radii may lie beyond the listed ones.
    if (of.empty()) return std::vector<Form>{};
    std::vector<Block> all;
    for (const Form& form : of) all.insert(all.end(), form.begin(), form.end());
    FitState trial = state;
    const LocalQuadratic l = local_quadratic(fitter, trial, place, all);
    const Eigen::VectorXd at_zero = l.score_without(trial.model.terms[place].coefficients);
    const ReducedColumns data = reduced_columns(l, at_zero, l.added_columns());
    const Chosen chosen = Choice(data, of).choose(most);
    std::vector<Form> found;
    std::vector<Block> blocks;
    for (const std::size_t f : chosen.forms) {
      found.push_back(of[f]);
      blocks.insert(blocks.end(), of[f].begin(), of[f].end());
    }
    if (found.empty()) return found;
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index c : chosen.columns) columns.push_back(l.own + c);
    replace_blocks(trial.model, place, l, blocks, at_zero, columns, chosen.sd);
    fitter.fit(trial, 1);
    refit(fitter, trial, place);
    const double reached = fitter.log_likelihood(trial);
    if (reached < likelihood + least_gain) return std::vector<Form>{};
    state = std::move(trial);
    likelihood = reached;
    return found;
  };
  const std::vector<Form> first = try_forms(forms, kFirstForms, 0);
  if (first.empty()) return false;
  // Noise and disc centres change with the first choice.
  fitter.fit_contacts(state);
  likelihood = fitter.log_likelihood(state);
  const std::vector<Form> finer = try_forms(with_reach_about(first), kFirstForms, kLeastEvidence);
  forms.insert(forms.end(), finer.begin(), finer.end());
  try_forms(forms, kMostForms, kLeastEvidence);
  return true;
}

}  // namespace kilotwin::identify
