#include "clients/identify/neighbour_shape.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "clients/identify/linear.hpp"
#include "clients/identify/refine.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Log evidence that one more form must bring, besides the price of choosing it.
constexpr double kWorth = 8;
constexpr std::size_t kMostForms = 5;
constexpr std::size_t kMostCounted = 6;

/// Of speed, by neighbours alone.
bool is_of_neighbours(const Block& block) {
  const auto neighbours = [](const Factor& f) {
    return f.known.empty() && (f.axis.of == Covariate::kNeighbours || f.axis.of == Covariate::kNearest ||
                               f.axis.of == Covariate::kDensity || f.axis.of == Covariate::kBearing);
  };
  const std::vector<Factor>& factors = block.basis.factors;
  return (block.target == Target::kGain || block.target == Target::kAhead) && !factors.empty() &&
         std::all_of(factors.begin(), factors.end(), neighbours);
}

/// The largest density within each radius that the data have, but for one look in a thousand.
std::array<double, kNeighbourRadii_mm.size()> densities(const PreparedSet& set) {
  std::array<std::vector<float>, kNeighbourRadii_mm.size()> all;
  constexpr double kEvery_s = 3;
  for (const TrackView& view : set.views()) {
    for (double t = view.track->samples.front().time_s; t < view.track->samples.back().time_s; t += kEvery_s)
      for (std::size_t r = 0; r < all.size(); ++r)
        all[r].push_back(view.neighbours->view(view.place, t).density[r]);
  }
  std::array<double, kNeighbourRadii_mm.size()> most{};
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (all[r].empty()) continue;
    const auto at = all[r].begin() + static_cast<std::ptrdiff_t>(all[r].size() - 1 - all[r].size() / 1000);
    std::nth_element(all[r].begin(), at, all[r].end());
    most[r] = *at;
  }
  return most;
}

std::vector<Block> forms_of(const PreparedSet& set, std::uint8_t during) {
  std::vector<Block> forms;
  const auto most = densities(set);
  const auto add = [&](Factor f, Covariate of, std::uint8_t radius) {
    f.axis = {of, radius};
    forms.push_back({Target::kGain, Basis{{std::move(f)}}, during});
  };
  for (std::uint8_t r = 0; r < kNeighbourRadii_mm.size(); ++r) {
    Factor table;
    table.shape = Shape::kAtLeast;
    for (std::size_t n = 1; n <= kMostCounted; ++n) table.points.push_back(static_cast<double>(n));
    if (r > 0) add(table, Covariate::kNeighbours, r);
    if (most[r] < 0.05) continue;
    Factor sum;
    sum.high = most[r];
    add(sum, Covariate::kDensity, r);
    // What levels off stays sensible among more neighbours than there were where nothing touched.
    sum.shape = Shape::kExponential;
    sum.points = {0.3, 1, 3};
    add(sum, Covariate::kDensity, r);
    Factor near;
    near.shape = Shape::kTaper;
    near.high = kNeighbourRadii_mm[r];
    near.count = 4;
    if (r > 0) add(near, Covariate::kNearest, r);
  }
  // By where the nearest is as well: ahead, at a side, behind. Of 60, 80 and 110 mm.
  for (const std::uint8_t r : std::array<std::uint8_t, 3>{2, 4, 7}) {
    Factor near, bearing;
    near.shape = Shape::kTaper;
    near.axis = {Covariate::kNearest, r};
    near.high = kNeighbourRadii_mm[r];
    near.count = 2;
    bearing.shape = Shape::kHarmonics;
    bearing.axis = {Covariate::kBearing, r};
    for (const auto& [target, waves] : {std::pair{Target::kGain, 2u}, {Target::kAhead, 1u}}) {
      bearing.count = waves;
      forms.push_back({target, Basis{{near, bearing}}, during});
    }
  }
  return forms;
}

/// Some of the forms, and the standard deviations of their columns beforehand.
struct Chosen {
  std::vector<std::size_t> forms;
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd sd;
  double evidence = 0;
};

class Choice {
 public:
  Choice(const Beside& data, const std::vector<Block>& forms) : data_(data) {
    Eigen::Index next = 0;
    for (const Block& form : forms) {
      std::vector<Eigen::Index> columns;
      Eigen::VectorXd sd(static_cast<Eigen::Index>(form.basis.size()));
      for (const double rough : form.basis.roughness()) {
        sd[static_cast<Eigen::Index>(columns.size())] = std::pow(rough, -1.5);
        columns.push_back(next++);
      }
      columns_.push_back(std::move(columns));
      sd_.push_back(std::move(sd));
    }
  }

  Chosen choose() const {
    Chosen chosen;
    const double price = std::log(static_cast<double>(columns_.size()));
    while (chosen.forms.size() < kMostForms) {
      // What is left of all beside those that are chosen.
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
        for (double size = 0.004; size < 8; size *= 2) {
          const double value = log_evidence(information, own_score, size * sd_[f]);
          if (value <= best) continue;
          best = value;
          best_form = f;
          best_sd = size * sd_[f];
        }
      }
      if (best < kWorth + price) break;
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
  const Beside& data_;
  std::vector<std::vector<Eigen::Index>> columns_;
  std::vector<Eigen::VectorXd> sd_;  ///< of the columns of a form, to be scaled
};

}  // namespace

bool shape_neighbours(const Fitter& fitter, MotionModel& model, std::size_t place) {
  const std::vector<Block>& had = model.terms[place].blocks;
  if (had.empty() || !std::all_of(had.begin(), had.end(), is_of_neighbours)) return false;
  const std::vector<Block> forms = forms_of(fitter.set(), had.front().during);
  // What seemed to be noise, and where robots were thought to be, changes with the first choice.
  constexpr int kRounds = 2;
  double likelihood = fitter.log_likelihood(model);
  bool any = false;
  for (int round = 0; round < kRounds; ++round) {
    MotionModel trial = model;
    const Linear l = linear(fitter, trial, place, forms);
    const Eigen::VectorXd at_zero = l.score_without(trial.terms[place].coefficients);
    const Beside data = beside(l, at_zero, l.more());
    const Chosen chosen = Choice(data, forms).choose();
    if (chosen.forms.empty()) break;
    std::vector<Block> blocks;
    for (const std::size_t f : chosen.forms) blocks.push_back(forms[f]);
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index c : chosen.columns) columns.push_back(l.own + c);
    exchange(trial, place, l, blocks, at_zero, columns, chosen.sd);
    fitter.fit(trial, 1);
    settle(fitter, trial, place);
    const double found = fitter.log_likelihood(trial);
    if (any && found < likelihood + kWorth) break;
    model = trial;
    likelihood = found;
    any = true;
    if (round + 1 < kRounds) fitter.fit_surroundings(model);
  }
  return any;
}

}  // namespace kilotwin::identify
