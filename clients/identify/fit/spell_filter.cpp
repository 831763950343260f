#include "clients/identify/fit/spell_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/likelihood.hpp"
#include "clients/identify/fit/spell_branches.hpp"

namespace kilotwin::identify {
namespace {

/// Histories; each costs a filter, fewer lose a spell that later samples would show.
constexpr std::size_t kMostHypotheses = 6;
/// A hypothesis this much less likely than the best is dropped, nat.
constexpr double kMostBelow = 12;

/// One interval of a history.
struct Node {
  std::ptrdiff_t parent;
  float share;
  bool in_spell;  ///< at its end
};

struct History {
  TrackFilter filter;
  double log_weight = 0;
  std::ptrdiff_t node = -1;
  SpellState spell;
};

double log_sum(double a, double b) { return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b))); }

class SpellFilter {
 public:
  SpellFilter(const MotionModel& model, const TrackView& view)
      : stalls_(*model.stalls), view_(view), samples_(view.track->samples) {
    RobotBias bias = model.bias_of(view.track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, view.track->robot, view.number);
    filter.start(samples_.front(), {}, view.start_heading_rad, view.start_heading_sd_rad);
    const double share = std::clamp(stalls_.share(), 1e-6, 0.5);
    histories_.push_back({filter, std::log(1 - share), -1, {}});
    histories_.push_back({filter, std::log(share), -1, {true, 0, 0}});
  }

  TrackSpells run() {
    for (std::size_t i = 1; i < samples_.size(); ++i) interval(i);
    if (view_.work != nullptr) *view_.work += steps_;
    return result();
  }

 private:
  /// Carries a filter through an interval of this branch. Returns whether the motion shows spells.
  bool carry(History& h, std::size_t i, const SpellBranch& branch) {
    LogLikelihood counted;
    bool driven = false;
    const double before_s = samples_[i - 1].time_s;
    h.filter.in_spell(branch.share, branch.variance_s, false);
    h.filter.at_boundary((*view_.at_boundary)[i - 1] || (*view_.at_boundary)[i]);
    sub_steps(*view_.clock, before_s, samples_[i].time_s,
              [&](double t, double step_s, const CommandState& commands) {
                const StepRecord record =
                    h.filter.step(t, step_s, commands, view_.neighbours->view(view_.place, t + step_s / 2));
                counted.step(record);
                driven = driven || commands.driven();
                ++steps_;
              });
    const Innovation innovation = h.filter.update(samples_[i], view_.clock->at(samples_[i].time_s - 1e-9));
    distance2_ = innovation.distance2;
    ContactGate gate = counted.gate;
    const bool free = gate.update(innovation) == ContactGate::Counts::kAll;
    counted.update(innovation, samples_[i]);
    h.log_weight += counted.sum;
    return driven && free;
  }
  void add(History h, const SpellBranch& branch) {
    h.spell = branch.after;
    h.log_weight += branch.log_probability;
    nodes_.push_back({h.node, static_cast<float>(branch.share), h.spell.in_spell});
    h.node = static_cast<std::ptrdiff_t>(nodes_.size()) - 1;
    next_.push_back(std::move(h));
  }
  void interval(std::size_t i) {
    const double length_s = samples_[i].time_s - samples_[i - 1].time_s;
    next_.clear();
    for (const History& h : histories_) {
      const SpellBranch stays = spell_stays(stalls_, h.spell, length_s);
      History same = h;
      const bool shown = carry(same, i, stays);
      if (!shown) add(same, spell_changes_unseen(stalls_, h.spell, length_s));
      if (shown && (h.spell.in_spell || distance2_ > kBenignForSpells))
        for (const SpellBranch& change : spell_changes(stalls_, h.spell, length_s)) {
          History other = h;
          carry(other, i, change);
          add(std::move(other), change);
        }
      add(std::move(same), stays);
    }
    prune();
  }
  /// Merges histories that were the same of late, and keeps the best.
  void prune() {
    std::stable_sort(next_.begin(), next_.end(),
                     [](const History& a, const History& b) { return a.log_weight > b.log_weight; });
    histories_.clear();
    for (History& h : next_) {
      const auto like = std::find_if(histories_.begin(), histories_.end(),
                                     [&](const History& k) { return k.spell.like(h.spell); });
      if (like != histories_.end()) {
        like->log_weight = log_sum(like->log_weight, h.log_weight);
      } else if (histories_.size() < kMostHypotheses &&
                 (histories_.empty() || h.log_weight > histories_.front().log_weight - kMostBelow)) {
        histories_.push_back(std::move(h));
      }
    }
  }

  [[nodiscard]] TrackSpells result() const {
    TrackSpells out;
    out.log_likelihood = histories_.front().log_weight;
    for (std::size_t h = 1; h < histories_.size(); ++h)
      out.log_likelihood = log_sum(out.log_likelihood, histories_[h].log_weight);
    out.share.assign(samples_.size(), 0);
    for (const History& h : histories_) {
      const double weight = std::exp(h.log_weight - out.log_likelihood);
      std::size_t i = samples_.size();
      for (std::ptrdiff_t n = h.node; n >= 0; n = nodes_[static_cast<std::size_t>(n)].parent)
        out.share[--i] += static_cast<float>(weight * nodes_[static_cast<std::size_t>(n)].share);
    }
    // The sum of the weights may round to more than 1, and the variance of such a share would be negative.
    for (float& share : out.share) share = std::min(share, 1.0F);
    add_spells(out);
    return out;
  }
  void add_spells(TrackSpells& out) const {
    const History& best =
        *std::max_element(histories_.begin(), histories_.end(),
                          [](const History& a, const History& b) { return a.log_weight < b.log_weight; });
    std::vector<Node> path;
    for (std::ptrdiff_t n = best.node; n >= 0; n = path.back().parent)
      path.push_back(nodes_[static_cast<std::size_t>(n)]);
    std::reverse(path.begin(), path.end());
    Spell spell{0, 0, false};
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double length_s = samples_[i + 1].time_s - samples_[i].time_s, share = path[i].share;
      out.between_s += (1 - share) * length_s;
      if (share > 0 && spell.length_s == 0)
        spell = {samples_[i].time_s + (1 - share) * length_s, 0, i == 0 && share == 1};
      spell.length_s += share * length_s;
      if (spell.length_s == 0 || (path[i].in_spell && i + 1 < path.size())) continue;
      spell.censored = spell.censored || path[i].in_spell;
      out.spells.push_back(std::exchange(spell, {0, 0, false}));
    }
  }

  const Stalls& stalls_;
  const TrackView& view_;
  const std::vector<Sample>& samples_;
  std::vector<History> histories_, next_;
  std::vector<Node> nodes_;
  std::uint64_t steps_ = 0;
  double distance2_ = 0;  ///< of the latest innovation
};

}  // namespace

TrackSpells spells_of(const MotionModel& model, const TrackView& view) { return SpellFilter(model, view).run(); }

}  // namespace kilotwin::identify
