#include "clients/identify/fit/prepared_set.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/identify/fit/filter_bank.hpp"
#include "clients/identify/fit/likelihood.hpp"
#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/model/camera_scale.hpp"
#include "clients/identify/model/visited_boundary.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {

PreparedSet::PreparedSet(const MeasuredSet& set, std::uint32_t first_number)
    : set_(&set), first_number_(first_number) {
  auto clocks = std::make_shared<std::vector<CommandClock>>();
  for (std::size_t r = 0; r < set.runs.size(); ++r) {
    auto neighbours = std::make_shared<RunNeighbours>(set.runs[r]);
    neighbours->update_traffic(set.runs[r], MotionModel{}.cells);
    for (std::size_t t = 0; t < set.runs[r].tracks.size(); ++t) {
      const Track& track = set.runs[r].tracks[t];
      if (track.samples.size() < 2) continue;
      const auto place = static_cast<std::uint32_t>(r);
      TrackView view{&track, place, first_number + place, t, neighbours.get()};
      view.work = work_.get();
      views_.push_back(view);
      clocks->emplace_back(track);
    }
    neighbours_.push_back(std::move(neighbours));
  }
  // Distance from the boundary of the visited places. A larger one counts free robots as at a wall; a smaller one overlooks
  // robots at walls.
  constexpr double kMargin_mm = 12;
  const VisitedBoundary boundary(set, kMargin_mm);
  auto at_boundary = std::make_shared<std::vector<std::vector<bool>>>();
  for (const TrackView& view : views_) {
    std::vector<bool>& near = at_boundary->emplace_back();
    for (const Sample& s : view.track->samples) near.push_back(boundary.is_near(s.x_mm, s.y_mm));
  }
  for (std::size_t v = 0; v < views_.size(); ++v) {
    views_[v].clock = &(*clocks)[v];
    views_[v].at_boundary = &(*at_boundary)[v];
  }
  clocks_ = std::move(clocks);
  at_boundary_ = std::move(at_boundary);
}

void PreparedSet::set_command_lag(double lag_s) {
  if (lag_s == command_lag_s_) return;
  command_lag_s_ = lag_s;
  auto clocks = std::make_shared<std::vector<CommandClock>>();
  for (const TrackView& view : views_) clocks->emplace_back(*view.track, lag_s);
  for (std::size_t v = 0; v < views_.size(); ++v) views_[v].clock = &(*clocks)[v];
  clocks_ = std::move(clocks);
  for (std::size_t r = 0; r < neighbours_.size(); ++r) {
    RunNeighbours neighbours = *neighbours_[r];
    neighbours.set_command_lag(set_->runs[r], lag_s);
    set_neighbours(r, std::move(neighbours));
  }
}

void PreparedSet::set_spells(std::vector<std::vector<float>> spells) {
  spells_ = std::make_shared<const std::vector<std::vector<float>>>(std::move(spells));
  for (std::size_t v = 0; v < views_.size(); ++v)
    views_[v].spells = (*spells_)[v].empty() ? nullptr : &(*spells_)[v];
}

void PreparedSet::set_neighbours(std::size_t run, RunNeighbours neighbours) {
  neighbours_[run] = std::make_shared<const RunNeighbours>(std::move(neighbours));
  for (TrackView& view : views_)
    if (view.run == run) view.neighbours = neighbours_[run].get();
}

std::vector<std::vector<const TrackView*>> PreparedSet::units() const {
  const std::vector<std::uint32_t> robots = set_->robots();
  constexpr std::size_t kFewRobots = 6;  // robots; with fewer, each track is a unit, so that there are more units
  std::vector<std::vector<const TrackView*>> units(robots.size() < kFewRobots ? views_.size() : robots.size());
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].track->held_out) continue;
    const auto robot = std::lower_bound(robots.begin(), robots.end(), views_[v].track->robot) - robots.begin();
    units[robots.size() < kFewRobots ? v : static_cast<std::size_t>(robot)].push_back(&views_[v]);
  }
  std::erase_if(units, [](const auto& unit) { return unit.empty(); });
  return units;
}

std::vector<const TrackView*> PreparedSet::some_tracks(std::size_t samples) const {
  std::vector<const TrackView*> chosen;
  for (const std::size_t v : some_views(samples)) chosen.push_back(&views_[v]);
  return chosen;
}

std::vector<std::size_t> PreparedSet::some_views(std::size_t samples) const {
  std::vector<std::size_t> chosen, all;
  for (std::size_t v = 0; v < views_.size(); ++v)
    if (!views_[v].track->held_out) all.push_back(v);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < all.size() && sum < samples; ++i) {
    chosen.push_back(all[(i * 7919) % all.size()]);
    sum += views_[chosen.back()].track->samples.size();
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

void PreparedSet::find_centres(const MotionModel& model, std::uint32_t threads) {
  std::vector<Centres> centres(views_.size());
  os::in_parallel(views_.size(), threads, [&](std::size_t v) { centres[v] = centres_of(model, views_[v]); });
  for (std::size_t r = 0; r < neighbours_.size(); ++r) {
    // A track too short for the filter uses its measured positions.
    std::vector<Centres> of_run;
    for (const Track& track : set_->runs[r].tracks) {
      Centres& own = of_run.emplace_back();
      for (const Sample& s : track.samples) {
        own.x_mm.push_back(s.x_mm);
        own.y_mm.push_back(s.y_mm);
      }
    }
    for (std::size_t v = 0; v < views_.size(); ++v)
      if (views_[v].run == r) of_run[views_[v].place] = std::move(centres[v]);
    RunNeighbours neighbours(set_->runs[r], &of_run, command_lag_s_);
    neighbours.update_traffic(set_->runs[r], model.cells);
    set_neighbours(r, std::move(neighbours));
  }
}

void PreparedSet::update_traffic(const MotionModel& model) {
  for (std::size_t r = 0; r < neighbours_.size(); ++r) {
    RunNeighbours neighbours = *neighbours_[r];
    neighbours.update_traffic(set_->runs[r], model.cells);
    set_neighbours(r, std::move(neighbours));
  }
}

Encounters PreparedSet::encounters() const {
  Encounters sum;
  // Raster of the counts; a finer one costs time and counts the same encounter more often.
  constexpr double kEvery_s = 1;
  for (const TrackView& view : views_) {
    const double first_s = view.track->samples.front().time_s;
    const auto instants = static_cast<int>(std::ceil((view.track->samples.back().time_s - first_s) / kEvery_s));
    for (int i = 0; i < instants; ++i) {
      const double t = first_s + i * kEvery_s;
      const double nearest = view.neighbours->view(view.place, t).nearest_mm;
      if (nearest < Encounters::kInside_mm) ++sum.within;
      if (nearest > kContactRange_mm && nearest < Encounters::kRing_mm) ++sum.near;
    }
  }
  return sum;
}

std::vector<RobotPair> PreparedSet::pairs() const {
  std::vector<RobotPair> pairs;
  for (std::size_t r = 0; r < neighbours_.size(); ++r)
    add_pairs(*neighbours_[r], set_->runs[r].tracks.size(), first_number_ + static_cast<std::uint32_t>(r), pairs);
  return pairs;
}

void PreparedSet::find_headings(const MotionModel& model, std::uint32_t threads) {
  os::in_parallel(views_.size(), threads, [&](std::size_t v) {
    TrackView& view = views_[v];
    const Sample& first = view.track->samples.front();
    if (TrackFilter::has_heading(first)) {
      view.start_heading_rad = first.heading_rad;
      view.start_heading_sd_rad = std::sqrt(model.noise.heading_rad2);
      return;
    }
    // Enough samples to cover a good distance, at most kMost.
    constexpr std::size_t kMost = 200;
    constexpr double kWay_mm = 60;
    std::size_t samples = 2;
    for (; samples < std::min(kMost, view.track->samples.size()); ++samples) {
      const Sample& s = view.track->samples[samples];
      if (std::hypot(s.x_mm - first.x_mm, s.y_mm - first.y_mm) > kWay_mm || TrackFilter::has_heading(s)) break;
    }
    const auto value = [&](double heading, double sd) {
      view.start_heading_rad = heading;
      view.start_heading_sd_rad = sd;
      TrackFilter filter(model, model.bias_of(view.track->robot), view.track->robot, view.number);
      LogLikelihood likelihood;
      run_filter(filter, view, samples + 1, likelihood);
      return likelihood.sum;
    };
    double best = 0, best_value = -1e300;
    const auto search = [&](double around, double spacing, int count, double sd) {
      for (int i = -count; i <= count; ++i) {
        const double heading = around + spacing * i, found = value(heading, sd);
        if (found > best_value) {
          best_value = found;
          best = heading;
        }
      }
    };
    search(0, M_PI / 8, 8, 0.25);
    best_value = -1e300;
    search(best, M_PI / 40, 3, 0.08);
    view.start_heading_rad = wrapped_angle(best);
    view.start_heading_sd_rad = 0.3;
  });
}

}  // namespace kilotwin::identify
