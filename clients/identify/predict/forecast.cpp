#include "clients/identify/predict/forecast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>

#include "clients/identify/fit/filter_bank.hpp"
#include "clients/identify/predict/rollout.hpp"
#include "clients/identify/predict/run_amplitude.hpp"

namespace kilotwin::identify {
namespace {

/// Places where a fine map of the floor changes steeply.
class Edges {
 public:
  explicit Edges(const MotionModel& model) {
    for (const Term& term : model.terms)
      for (const Block& block : term.blocks)
        if (block.basis.factors.size() == 1 && block.basis.factors.front().shape == Factor::Shape::kGrid)
          maps_.push_back(&block.basis);
  }
  [[nodiscard]] bool any() const { return !maps_.empty(); }
  [[nodiscard]] bool near(double x_mm, double y_mm, double reach_mm) const {
    constexpr double kMuch = 0.1;  // relative to the robot's speed
    for (const Basis* const map : maps_) {
      double least = 1e300, most = -1e300;
      for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        Situation s;
        s.x_mm = x_mm + x * reach_mm;
        s.y_mm = y_mm + y * reach_mm;
        double value = 0;
        map->evaluate(s, 0, &value);
        least = std::min(least, value);
        most = std::max(most, value);
      }
      if (most - least > kMuch) return true;
    }
    return false;
  }

 private:
  std::vector<const Basis*> maps_;
};

/// Forecasts of the robots of one run, from an instant on by their commands alone.
class Outlook {
 public:
  Outlook(const MotionModel& model, std::vector<Follower>& followers, const Floors& floors, double from_s,
          bool neighbours)
      : model_(model),
        neighbours_(neighbours),
        now_s_(from_s),
        edges_(model),
        floors_(floors),
        floors_then_(floors) {
    for (Follower& follower : followers) {
      Robot& robot = robots_.emplace_back();
      robot.view = &follower.view();
      if (!follower.started()) continue;
      double sum = 0;
      for (const auto& h : follower.hypotheses()) sum += std::exp(h.log_weight);
      for (const auto& h : follower.hypotheses()) {
        robot.filters.push_back(h.filter);
        robot.weights.push_back(std::exp(h.log_weight) / sum);
      }
      robot.now_s = follower.last_s();
      Starting& start = robot.start;
      start.view = robot.view;
      start.weights = robot.weights;
      for (const auto& h : follower.hypotheses()) start.filters.push_back(&h.filter);
      start.now_s = robot.now_s;
    }
  }
  /// Advances to a time. Robots see each other on a time raster.
  void go_to(double to_s) {
    constexpr double kRaster_s = 0.25;
    while (now_s_ < to_s - 1e-9) {
      const double next = neighbours_ ? std::min(to_s, now_s_ + kRaster_s) : to_s;
      see(next - now_s_);
      advance(next);
      now_s_ = next;
    }
    advance(to_s);
  }
  /// Replaces the forecasts of robots with contacts, steep maps or large uncertainty by means of Monte Carlo
  /// rollouts.
  void draw_futures(double from_s, std::uint32_t count, bool all, std::array<std::uint32_t, 2> key) {
    std::vector<Starting> together;
    std::vector<std::size_t> who;
    bool any = false;
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      if (robots_[r].filters.empty()) continue;
      any = any || robots_[r].branches;
      if (!all && !robots_[r].branches) continue;
      together.push_back(robots_[r].start);
      who.push_back(r);
    }
    if (!any) return;
    const std::vector<Foreseen> seen = futures(model_, together, floors_then_, from_s, now_s_, count, all, key);
    for (std::size_t i = 0; i < who.size(); ++i)
      if (robots_[who[i]].branches) robots_[who[i]].foreseen = seen[i];
  }
  bool expected(std::size_t place, Predicted& out) const {
    const Robot& robot = robots_[place];
    if (robot.filters.empty()) return false;
    if (robot.foreseen) {
      out.x_mm = robot.foreseen->x_mm;
      out.y_mm = robot.foreseen->y_mm;
      out.spread_mm = std::sqrt(robot.foreseen->square_mm2 + 2 * model_.noise.position_mm2);
      return true;
    }
    const CommandState commands = robot.view->clock.at(now_s_ - 1e-9);
    double x = 0, y = 0, square = 0, spread = 0;
    for (std::size_t i = 0; i < robot.filters.size(); ++i) {
      const Eigen::Vector3d seen = robot.filters[i].expected(now_s_, commands);
      x += robot.weights[i] * seen[0];
      y += robot.weights[i] * seen[1];
      square += robot.weights[i] * seen.head<2>().squaredNorm();
      spread += robot.weights[i] * robot.filters[i].expected_spread_mm2(now_s_, commands);
    }
    out.x_mm = x;
    out.y_mm = y;
    out.spread_mm = std::sqrt(spread + std::max(0.0, square - x * x - y * y) + 2 * model_.noise.position_mm2);
    return true;
  }

 private:
  struct Robot {
    const TrackView* view = nullptr;
    std::vector<TrackFilter> filters;
    std::vector<double> weights;
    double now_s = 0;
    NeighbourView near;
    Starting start;
    bool branches = false;  ///< the mean of the futures is not the future of the mean
    std::optional<Foreseen> foreseen;
  };
  /// Updates neighbour views and traffic, for the next `for_s`.
  void see(double for_s) {
    if (!neighbours_) return;
    locate();
    list_.clear();
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      robots_[r].near = {};
      if (std::isnan(x_[r])) continue;
      robots_[r].near = view_of(r, x_, y_, &list_);
      const StateCovariance& p = robots_[r].filters.front().belief().covariance;
      const double uncertain = 1.5 * std::sqrt(p(0, 0) + p(1, 1));
      if (model_.contacts && robots_[r].near.nearest_mm < model_.touch_mm + std::min(uncertain, 20.0))
        robots_[r].branches = true;
      // With traffic grids, effects change from cell to cell: the mean path does not suffice.
      if (floors_.any()) robots_[r].branches = true;
      if (!robots_[r].branches) robots_[r].branches = edges_.near(x_[r], y_[r], std::clamp(uncertain, 6.0, 30.0));
      floors_.see(x_[r], y_[r], robots_[r].near);
    }
    for (std::size_t r = 0; floors_.any() && r < robots_.size(); ++r)
      if (!std::isnan(x_[r]) && robots_[r].view->clock.at(now_s_).driven()) floors_.add(x_[r], y_[r], for_s);
  }
  void locate() {
    x_.assign(robots_.size(), std::nan(""));
    y_ = x_;
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      if (robots_[r].filters.empty()) continue;
      x_[r] = y_[r] = 0;
      for (std::size_t i = 0; i < robots_[r].filters.size(); ++i) {
        x_[r] += robots_[r].weights[i] * robots_[r].filters[i].belief().centre_x_mm();
        y_[r] += robots_[r].weights[i] * robots_[r].filters[i].belief().centre_y_mm();
      }
    }
  }
  void advance(double to_s) {
    for (Robot& robot : robots_) {
      for (TrackFilter& filter : robot.filters)
        sub_steps(robot.view->clock, robot.now_s, to_s, [&](double t, double h, const CommandState& commands) {
          filter.step_mean(t, h, commands, robot.near);
        });
      if (!robot.filters.empty()) robot.now_s = std::max(robot.now_s, to_s);
    }
    if (model_.contacts) push();
  }

  /// Separates overlapping robots.
  void push() {
    locate();
    const std::vector<double> x = x_, y = y_;
    push_apart(x_, y_);
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      if (std::isnan(x[r]) || (x_[r] == x[r] && y_[r] == y[r])) continue;
      for (TrackFilter& filter : robots_[r].filters) {
        filter.belief().mean[0] += model_.room.inside_x(x_[r]) - x[r];
        filter.belief().mean[1] += model_.room.inside_y(y_[r]) - y[r];
      }
    }
  }

  const MotionModel& model_;
  const bool neighbours_;
  double now_s_;
  const Edges edges_;
  Floors floors_;
  const Floors& floors_then_;
  std::vector<Robot> robots_;
  std::vector<double> x_, y_;
  std::vector<OtherRobot> list_;  ///< neighbours of all robots
};

/// Traffic of a run, by the measurements so far.
class Trodden {
 public:
  Trodden(const MotionModel& model, std::size_t robots) : known_(model), next_(robots, 0) {}

  [[nodiscard]] Floors at(double now_s, const std::vector<Follower>& followers) {
    for (std::size_t f = 0; known_.any() && f < followers.size(); ++f) {
      if (!followers[f].started()) continue;
      const auto [near, place] = of(followers[f]);
      for (std::size_t& i = next_[f];
           i < near->instants() && is_before(near->time_s(i), followers[f].last_s(), now_s); ++i)
        add(near->spot(place, i), known_);
    }
    Floors now = known_;
    // From their last samples on, robots count as standing there.
    for (std::size_t f = 0; known_.any() && f < followers.size(); ++f) {
      if (!followers[f].started() || next_[f] == 0) continue;
      const auto [near, place] = of(followers[f]);
      RunNeighbours::Spot last = near->spot(place, next_[f] - 1);
      for (std::size_t i = next_[f]; i < near->instants() && near->time_s(i) < now_s - 1e-6; ++i) {
        last.driven = followers[f].view().clock.at(near->time_s(i) + 1e-9).driven();
        add(last, now);
      }
    }
    return now;
  }

 private:
  static std::pair<const RunNeighbours*, std::size_t> of(const Follower& follower) {
    return {follower.view().neighbours, follower.view().place};
  }
  static bool is_before(double time_s, double seen_s, double now_s) {
    return time_s <= seen_s + 1e-6 && time_s < now_s - 1e-6;
  }
  static void add(const RunNeighbours::Spot& spot, Floors& to) {
    if (!std::isnan(spot.x_mm) && spot.driven) to.add(spot.x_mm, spot.y_mm, RunNeighbours::kRaster_s);
  }
  Floors known_;
  std::vector<std::size_t> next_;  ///< first instant that is not added yet
};

/// The end of a run is unknown. It may last until the next frame, which need not exist.
double end_of(const std::vector<Sample>& samples) {
  constexpr double kFrames = 2;
  const double span_s = samples.back().time_s - samples.front().time_s;
  return samples.back().time_s +
         kFrames * span_s / static_cast<double>(std::max<std::size_t>(samples.size() - 1, 1));
}

bool looks_at_neighbours(const MotionModel& model) {
  for (const Term& term : model.terms)
    for (const Block& block : term.blocks)
      for (const Covariate c :
           {Covariate::kNeighbours, Covariate::kNearest, Covariate::kDensity, Covariate::kBearing})
        if (block.basis.looks_at(c)) return true;
  return false;
}

}  // namespace

bool measured_at(const Track& track, double time_s, Sample& out) {
  const auto at = std::lower_bound(track.samples.begin(), track.samples.end(), time_s - 0.01,
                                   [](const Sample& s, double t) { return s.time_s < t; });
  if (at == track.samples.end() || at->time_s > time_s + 0.01) return false;
  out = *at;
  return true;
}

namespace {

/// A run under one of the models with different run amplitudes.
struct RunOutlook {
  RunOutlook(const MotionModel& of, const std::vector<const TrackView*>& views, bool near)
      : model(of), neighbours(near), trodden(model, views.size()) {
    followers.reserve(views.size());
    for (const TrackView* view : views) followers.emplace_back(model, *view);
  }
  RunOutlook(const RunOutlook&) = delete;
  void follow(double to_s) {
    for (Follower& follower : followers) follower.follow(to_s);
  }
  [[nodiscard]] double log_likelihood() const {
    double sum = 0;
    for (const Follower& follower : followers) sum += follower.log_likelihood();
    return sum;
  }
  /// By track. NaN: no forecast.
  std::vector<Predicted> at(double from_s, double time_s, std::uint32_t futures, bool all,
                            std::array<std::uint32_t, 2> key) {
    const Floors floors = trodden.at(from_s, followers);
    Outlook outlook(model, followers, floors, from_s, neighbours);
    outlook.go_to(time_s);
    if (futures > 0 && (model.contacts || floors.any() || Edges(model).any()))
      outlook.draw_futures(from_s, futures, all, key);
    std::vector<Predicted> out;
    for (std::size_t i = 0; i < followers.size(); ++i) {
      const TrackView& view = followers[i].view();
      Predicted p{view.run, static_cast<std::uint32_t>(view.place), time_s, 0, 0, 0};
      if (!outlook.expected(i, p)) p.x_mm = std::nan("");
      out.push_back(p);
    }
    return out;
  }

  const MotionModel model;
  const bool neighbours;
  std::vector<Follower> followers;
  Trodden trodden;
};

}  // namespace

std::vector<Predicted> predict(const MotionModel& model, const PreparedSet& set, const Asked& asked,
                               bool held_out_only, std::uint32_t threads) {
  const std::vector<Run>& runs = set.set().runs;
  std::vector<std::vector<Predicted>> by_run(runs.size());
  const bool effects_of_neighbours = looks_at_neighbours(model),
             neighbours = effects_of_neighbours || model.contacts || Floors(model).any() || Edges(model).any();
  in_parallel(runs.size(), threads, [&](std::size_t run) {
    std::vector<const TrackView*> views;
    double last_s = 0;
    bool wanted = false;
    for (const TrackView& view : set.views()) {
      if (view.run != run) continue;
      if (held_out_only && !view.track->held_out && !neighbours) continue;
      wanted = wanted || !held_out_only || view.track->held_out;
      views.push_back(&view);
      last_s = std::max(last_s, end_of(view.track->samples));
    }
    if (!wanted) return;
    const RunAmount amount(model, views.front()->number);
    std::deque<RunOutlook> outlooks;
    for (const MotionModel& one : amount.models()) outlooks.emplace_back(one, views, neighbours);
    const double first_s = std::max(asked.first_s, std::ceil(asked.horizon_s / asked.every_s) * asked.every_s);
    for (int k = 0;; ++k) {
      const double time_s = first_s + k * asked.every_s;
      if (time_s > last_s + 1e-6) break;
      const double from_s = time_s - asked.horizon_s;
      std::vector<double> log_likelihood;
      for (RunOutlook& outlook : outlooks) {
        outlook.follow(from_s);
        log_likelihood.push_back(outlook.log_likelihood());
      }
      const RunAmount::Between between = outlooks.size() > 1 ? amount.mean(log_likelihood) : RunAmount::Between{};
      const auto foretold = [&](std::size_t i) {
        return outlooks[i].at(from_s, time_s, asked.futures, effects_of_neighbours,
                              {static_cast<std::uint32_t>(run), static_cast<std::uint32_t>(k)});
      };
      std::vector<Predicted> seen = foretold(between.low);
      if (between.high != between.low) {
        const std::vector<Predicted> high = foretold(between.high);
        for (std::size_t i = 0; i < seen.size(); ++i) {
          for (double Predicted::*const number : {&Predicted::x_mm, &Predicted::y_mm, &Predicted::spread_mm})
            seen[i].*number += between.part * (high[i].*number - seen[i].*number);
        }
      }
      for (std::size_t i = 0; i < seen.size(); ++i)
        if (!std::isnan(seen[i].x_mm) && (!held_out_only || views[i]->track->held_out))
          by_run[run].push_back(seen[i]);
    }
  });
  std::vector<Predicted> all;
  for (const auto& part : by_run) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace kilotwin::identify
