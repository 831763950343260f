#include "clients/identify/fit/filter_bank.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/contact_gate.hpp"

namespace kilotwin::identify {
namespace {

/// Logarithm of the sum of the hypotheses' weights.
double total_of(const std::vector<FilterBank::Hypothesis>& hypotheses) {
  double best = -1e300, sum = 0;
  for (const auto& h : hypotheses) best = std::max(best, h.log_weight);
  for (const auto& h : hypotheses) sum += std::exp(h.log_weight - best);
  return best + std::log(sum);
}

}  // namespace

void FilterBank::take_model(const MotionModel& model) {
  model_ = &model;
  for (Hypothesis& h : hypotheses_) h.filter.take_model(model);
}

void FilterBank::advance_to(double to_s) {
  const std::vector<Sample>& samples = view_->track->samples;
  for (; next_ < samples.size() && samples[next_].time_s <= to_s + 1e-6; ++next_) take(samples[next_]);
}

void FilterBank::take(const Sample& sample) {
  if (next_ == 0) return start(sample);
  // Beside many headings nobody can tell a spell, nor a push. A larger value takes them for the causes of a wrong heading's errors.
  constexpr std::size_t kFewHeadings = 2;
  const bool few = hypotheses_.front().spell || hypotheses_.size() <= kFewHeadings;
  for (Hypothesis& h : hypotheses_) h.filter.contacts_displace(few);
  const double weight = total_of(hypotheses_);
  if (model_->stalls && few)
    hypotheses_ = with_spells(sample);
  else
    for (Hypothesis& h : hypotheses_) carry(h, sample);
  log_likelihood_ += total_of(hypotheses_) - weight;
  // Every hypothesis lost the track: the position is known, the heading may be another one.
  if (std::all_of(hypotheses_.begin(), hypotheses_.end(), [](const Hypothesis& h) { return h.lost; }))
    return restart(sample);
  prune();
}

bool FilterBank::carry(Hypothesis& h, const Sample& sample) const {
  // Nat, as kHopeless: a hypothesis that lost the track goes where another one followed it. A smaller value keeps it for
  // longer.
  constexpr double kLost = 20;
  const double from_s = last_s();
  ContactGate gate;
  bool driven = false;
  sub_steps(*view_->clock, from_s, sample.time_s, [&](double t, double length, const CommandState& commands) {
    gate.step(h.filter.step(t, length, commands, view_->neighbours->view(view_->place, std::min(t, from_s))));
    driven = driven || commands.driven();
  });
  const Innovation innovation = h.filter.update(sample, view_->clock->at(sample.time_s - 1e-9));
  h.distance2 = innovation.distance2;
  h.lost = innovation.lost && innovation.size == 2;
  h.log_weight += innovation.log_likelihood;
  if (h.lost) h.log_weight -= kLost;
  return driven && gate.update(innovation) == ContactGate::Counts::kAll;
}

std::vector<FilterBank::Hypothesis> FilterBank::with_spells(const Sample& sample) const {
  const Stalls& stalls = *model_->stalls;
  const double length_s = sample.time_s - last_s(), share = std::clamp(stalls.share(), 1e-6, 0.5);
  std::vector<Hypothesis> before, after;
  for (const Hypothesis& h : hypotheses_) {
    before.push_back(h);
    if (h.spell) continue;
    before.back().spell = SpellState{};
    before.back().log_weight += std::log(1 - share);
    before.push_back(h);
    before.back().spell = SpellState{true, 0, 0};
    before.back().log_weight += std::log(share);
  }
  const auto add = [&](Hypothesis h, const SpellBranch& branch) {
    h.spell = branch.after;
    h.log_weight += branch.log_probability;
    after.push_back(std::move(h));
  };
  const auto carried = [&](Hypothesis h, const SpellBranch& branch, bool& shown) {
    h.filter.in_spell(branch.share, branch.variance_s, false);
    shown = carry(h, sample);
    return h;
  };
  for (const Hypothesis& h : before) {
    bool shown = false;
    const SpellBranch stays = spell_stays(stalls, *h.spell, length_s);
    const Hypothesis same = carried(h, stays, shown);
    if (!shown) {
      add(same, spell_changes_unseen(stalls, *h.spell, length_s));
    } else if (before.size() > 1 || h.spell->in_spell || same.distance2 > kBenignForSpells) {
      for (const SpellBranch& change : spell_changes(stalls, *h.spell, length_s))
        add(carried(h, change, shown), change);
    }
    add(same, stays);
  }
  return after;
}

void FilterBank::start(const Sample& sample) {
  RobotBias bias = model_->bias_of(view_->track->robot);
  hypotheses_.clear();
  const auto add = [&](double heading, double sd) {
    TrackFilter filter(*model_, bias, view_->track->robot, view_->number);
    filter.start(sample, {}, heading, sd);
    filter.stay_within_walls();
    hypotheses_.push_back({std::move(filter)});
  };
  if (TrackFilter::has_heading(sample)) return add(sample.heading_rad, std::sqrt(model_->noise.heading_rad2));
  // Headings to start from, 20 degrees apart; each costs a filter, fewer may miss the true one.
  constexpr int kHeadings = 18;
  for (int i = 0; i < kHeadings; ++i) add(2 * M_PI * i / kHeadings, M_PI / kHeadings);
}

void FilterBank::restart(const Sample& sample) {
  // A push by another robot displaces and turns a robot. Else a wrong heading has lost the track.
  constexpr double kOfAny = 0.3;
  const std::vector<Hypothesis> before = std::exchange(hypotheses_, {});
  const double total = total_of(before);
  start(sample);
  for (Hypothesis& h : hypotheses_) {
    double density = 0, all = 0;
    for (const Hypothesis& one : before) {
      const Belief &belief = one.filter.belief(), &own = h.filter.belief();
      const double variance = belief.covariance(2, 2);
      const auto likely = [&](double heading_rad) {
        const double apart = wrapped_angle(heading_rad - belief.mean[2]);
        return std::exp(-apart * apart / (2 * variance));
      };
      double sum = 0;
      for (const Hypothesis& other : hypotheses_) sum += likely(other.filter.belief().mean[2]);
      const double weight = std::exp(one.log_weight - total);
      density += weight * likely(own.mean[2]) / sum;
      all += weight;
    }
    const double share = kOfAny / static_cast<double>(hypotheses_.size()) + (1 - kOfAny) * density / all;
    // Weights that are no numbers know nothing.
    h.log_weight = std::isfinite(share) ? std::log(share) : 0;
  }
}

void FilterBank::prune() {
  // Nat below the best; a smaller value drops hypotheses that later samples would favour.
  constexpr double kHopeless = 20;
  // A weight that is no finite number is as good as none. If no weight is finite, all hypotheses stay, with equal weights.
  double best = -1e300;
  for (const Hypothesis& h : hypotheses_)
    if (std::isfinite(h.log_weight)) best = std::max(best, h.log_weight);
  const bool any = best > -1e300;
  for (Hypothesis& h : hypotheses_) h.log_weight = any ? h.log_weight - best : 0;
  std::erase_if(hypotheses_,
                [](const Hypothesis& h) { return !std::isfinite(h.log_weight) || h.log_weight < -kHopeless; });
  merge();
  // Histories of spells; each costs a filter, fewer lose a spell that later samples would show.
  constexpr std::size_t kMostHistories = 6;
  if (!hypotheses_.front().spell || hypotheses_.size() <= kMostHistories) return;
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.log_weight > b.log_weight; });
  hypotheses_.erase(hypotheses_.begin() + kMostHistories, hypotheses_.end());
}

/// Merges hypotheses that have converged to the same heading, with spells that were the same of late.
void FilterBank::merge() {
  for (std::size_t i = 0; i + 1 < hypotheses_.size(); ++i) {
    for (std::size_t j = i + 1; j < hypotheses_.size();) {
      const Belief& a = hypotheses_[i].filter.belief();
      const Belief& b = hypotheses_[j].filter.belief();
      const std::optional<SpellState>&of_a = hypotheses_[i].spell, &of_b = hypotheses_[j].spell;
      const double apart = wrapped_angle(a.mean[2] - b.mean[2]);
      const bool alike = !of_a || !of_b || of_a->like(*of_b);
      if (alike && apart * apart < 0.25 * std::min(a.covariance(2, 2), b.covariance(2, 2))) {
        const double wa = std::exp(hypotheses_[i].log_weight), wb = std::exp(hypotheses_[j].log_weight);
        if (wb > wa) {
          hypotheses_[i].filter = hypotheses_[j].filter;
          hypotheses_[i].spell = hypotheses_[j].spell;
        }
        hypotheses_[i].log_weight = std::log(wa + wb);
        hypotheses_.erase(hypotheses_.begin() + static_cast<std::ptrdiff_t>(j));
      } else {
        ++j;
      }
    }
  }
}

Centres centres_of(const MotionModel& model, const TrackView& view) {
  Centres centres;
  FilterBank bank(model, view);
  for (const Sample& sample : view.track->samples) {
    bank.advance_to(sample.time_s);
    double sum = 0, x = 0, y = 0;
    for (const FilterBank::Hypothesis& h : bank.hypotheses()) {
      const double weight = std::exp(h.log_weight);
      sum += weight;
      x += weight * h.filter.belief().centre_x_mm();
      y += weight * h.filter.belief().centre_y_mm();
    }
    centres.x_mm.push_back(x / sum);
    centres.y_mm.push_back(y / sum);
  }
  return centres;
}

}  // namespace kilotwin::identify
