#include "clients/identify/fit/spell_scan.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "clients/identify/fit/likelihood.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {

SpellScan::SpellScan(const FitState& state, std::uint32_t threads)
    : views_(state.tracks.views()), threads_(threads) {
  plain_.assign(views_.size(), 0);
  os::in_parallel(views_.size(), threads_, [&](std::size_t v) {
    if (!views_[v].track->held_out) plain_[v] = likelihood_of(state.model, views_[v]).sum;
  });
  std::vector<double> lengths_s;
  for (const TrackView& view : views_) {
    const std::vector<Sample>& samples = view.track->samples;
    longest_s_ = std::max(longest_s_, samples.back().time_s - samples.front().time_s);
    lengths_s.push_back((samples.back().time_s - samples.front().time_s) / static_cast<double>(samples.size() - 1));
  }
  least_s_ = stats::upper_median(lengths_s) / 2;
}

SpellScan::Found SpellScan::scan(const MotionModel& model,
                                 const std::function<Stalls(std::size_t)>& stalls_of) const {
  Found out;
  out.tracks.resize(views_.size());
  out.gains.assign(views_.size(), 0);
  os::in_parallel(views_.size(), threads_, [&](std::size_t v) {
    if (views_[v].track->held_out) return;
    MotionModel with = model;
    with.stalls = stalls_of(v);
    out.tracks[v] = spells_of(with, views_[v]);
    out.gains[v] = out.tracks[v].log_likelihood - plain_[v];
  });
  for (std::size_t v = 0; v < views_.size(); ++v) {
    out.spells += out.tracks[v].spells.size();
    out.gain += out.gains[v];
  }
  return out;
}

SpellScan::Found SpellScan::scan(const MotionModel& model, const Stalls& stalls) const {
  return scan(model, [&](std::size_t) { return stalls; });
}

SpellScan::Shown SpellScan::shown_by(const Found& found, const std::function<bool(std::size_t)>& use) const {
  Shown out;
  for (std::size_t v = 0; v < found.tracks.size(); ++v) {
    if (!use(v)) continue;
    out.between_s += found.tracks[v].between_s;
    for (const Spell& spell : found.tracks[v].spells) {
      out.spells.push_back(spell);
      out.starts += spell.start_s > views_[v].track->samples.front().time_s ? 1 : 0;
    }
  }
  return out;
}

Stalls SpellScan::refined(const Found& found, Stalls stalls, const std::function<bool(std::size_t)>& use) const {
  const Shown shown = shown_by(found, use);
  // Beyond what any track shows.
  stalls.longest_s = 2 * longest_s_;
  fit_lengths(shown.spells, least_s_, stalls);
  // Short spells are not seen.
  if (shown.between_s > 0)
    stalls.mean_apart_s = std::max(1.0, shown.between_s * stalls.survival(least_s_) / std::max(shown.starts, 0.5));
  return stalls;
}

SpellScan::Intervals SpellScan::intervals(const Found& found, const Stalls& stalls) const {
  const Shown shown = shown_by(found, [](std::size_t) { return true; });
  const double seen_s = shown.between_s * stalls.survival(least_s_);
  const auto [fewest, most] = stats::poisson_interval(shown.starts);
  return {{seen_s / most, fewest > 0 ? seen_s / fewest : INFINITY},
          mean_length_interval_s(shown.spells, least_s_, stalls)};
}

Stalls SpellScan::refined(const Found& found, const Stalls& stalls) const {
  return refined(found, stalls, [](std::size_t) { return true; });
}

double SpellScan::dispersion(const Found& found) const {
  struct Instant {
    double stalled = 0, robots = 0;
  };
  std::map<std::pair<std::uint32_t, long>, Instant> instants;  // by run and sampling interval
  const double step_s = 2 * least_s_;
  double stalled = 0, all = 0;
  for (std::size_t v = 0; v < found.tracks.size(); ++v) {
    const std::vector<Sample>& samples = views_[v].track->samples;
    for (std::size_t i = 1; i < found.tracks[v].share.size(); ++i) {
      Instant& at = instants[{views_[v].run, std::lround(samples[i].time_s / step_s)}];
      at.stalled += static_cast<double>(found.tracks[v].share[i]);
      at.robots += 1;
      stalled += static_cast<double>(found.tracks[v].share[i]);
      all += 1;
    }
  }
  const double share = all > 0 ? stalled / all : 0;
  double squares = 0, expected = 0;
  for (const auto& [when, at] : instants) {
    if (at.robots < 2) continue;
    squares += std::pow(at.stalled - share * at.robots, 2);
    expected += at.robots * share * (1 - share);
  }
  return expected > 0 ? squares / expected : 1;
}

double SpellScan::share_at_obstacles(const Found& found, const MotionModel& model) const {
  // Beyond contacts as the model has them, and beyond what a robot passes in a few seconds.
  constexpr double kNear_mm = 40;
  struct Time {
    double stalled = 0, all = 0;
  };
  Time near, far;
  for (std::size_t v = 0; v < found.tracks.size(); ++v) {
    const TrackView& view = views_[v];
    for (std::size_t i = 1; i < found.tracks[v].share.size(); ++i) {
      const Sample& sample = view.track->samples[i];
      const bool at_obstacle = model.walls.at_wall(sample.x_mm, sample.y_mm, kNear_mm) ||
                               (model.contacts && view.neighbours->view(view.place, sample.time_s).nearest_mm <
                                                      model.contact_range_mm + kNear_mm);
      Time& time = at_obstacle ? near : far;
      time.stalled += static_cast<double>(found.tracks[v].share[i]);
      time.all += 1;
    }
  }
  if (near.all == 0 || far.all == 0 || near.stalled == 0) return 1;
  return near.stalled / near.all / (std::max(far.stalled, 0.5) / far.all);
}

}  // namespace kilotwin::identify
