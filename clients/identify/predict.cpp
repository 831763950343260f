#include "clients/identify/predict.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

/// A robot's filter while it is led along its track; several while nobody knows which way it points.
class Follower {
 public:
  Follower(const MotionModel& model, const TrackView& view) : model_(model), view_(view) {}

  /// Takes in all samples up to this time.
  void follow(double to_s) {
    const std::vector<Sample>& samples = view_.track->samples;
    for (; next_ < samples.size() && samples[next_].time_s <= to_s + 1e-6; ++next_) take(samples[next_]);
  }
  [[nodiscard]] bool started() const { return next_ > 0; }
  /// Between the last sample and `to_s`.
  [[nodiscard]] double last_s() const { return view_.track->samples[next_ - 1].time_s; }

  struct Hypothesis {
    TrackFilter filter;
    double log_weight = 0;
  };
  [[nodiscard]] const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  [[nodiscard]] const TrackView& view() const { return view_; }

 private:
  void take(const Sample& sample) {
    if (next_ == 0) return start(sample);
    const double from_s = last_s();
    for (Hypothesis& h : hypotheses_) {
      sub_steps(view_.clock, from_s, sample.time_s, [&](double t, double length, const CommandState& commands) {
        h.filter.step(t, length, commands, view_.neighbours->view(view_.place, std::min(t, from_s)));
      });
      const Innovation innovation = h.filter.update(sample, view_.clock.at(sample.time_s - 1e-9));
      h.log_weight += innovation.log_likelihood;
      if (innovation.lost && innovation.size == 2) h.log_weight -= 20;
    }
    prune();
  }
  void start(const Sample& sample) {
    const RobotBias bias = model_.bias_of(view_.track->robot);
    const auto add = [&](double heading, double sd) {
      TrackFilter filter(model_, bias, view_.track->robot, view_.run);
      filter.start(sample, {}, heading, sd);
      hypotheses_.push_back({std::move(filter), 0});
    };
    if (TrackFilter::has_heading(sample)) return add(sample.heading_rad, std::sqrt(model_.noise.heading_rad2));
    constexpr int kHeadings = 16;
    for (int i = 0; i < kHeadings; ++i) add(2 * M_PI * i / kHeadings, M_PI / kHeadings / 1.7);
  }
  void prune() {
    double best = -1e300;
    for (const Hypothesis& h : hypotheses_) best = std::max(best, h.log_weight);
    for (Hypothesis& h : hypotheses_) h.log_weight -= best;
    std::erase_if(hypotheses_, [](const Hypothesis& h) { return h.log_weight < -9; });
    // Two that have become the same are one.
    for (std::size_t i = 0; i + 1 < hypotheses_.size(); ++i) {
      for (std::size_t j = i + 1; j < hypotheses_.size();) {
        const Belief& a = hypotheses_[i].filter.belief();
        const Belief& b = hypotheses_[j].filter.belief();
        const double apart = wrapped_angle(a.mean[2] - b.mean[2]);
        if (apart * apart < 0.25 * std::min(a.covariance(2, 2), b.covariance(2, 2))) {
          const double wa = std::exp(hypotheses_[i].log_weight), wb = std::exp(hypotheses_[j].log_weight);
          if (wb > wa) hypotheses_[i].filter = hypotheses_[j].filter;
          hypotheses_[i].log_weight = std::log(wa + wb);
          hypotheses_.erase(hypotheses_.begin() + static_cast<std::ptrdiff_t>(j));
        } else {
          ++j;
        }
      }
    }
  }

  const MotionModel& model_;
  const TrackView& view_;
  std::vector<Hypothesis> hypotheses_;
  std::size_t next_ = 0;
};

/// Robots of a run that go on from an instant by their commands alone.
class Outlook {
 public:
  Outlook(const MotionModel& model, std::vector<Follower>& followers, double from_s, bool neighbours)
      : model_(model), neighbours_(neighbours), now_s_(from_s) {
    for (Follower& follower : followers) {
      Robot& robot = robots_.emplace_back();
      robot.view = &follower.view();
      if (!follower.started() || from_s - follower.last_s() > 30) continue;
      double sum = 0;
      for (const auto& h : follower.hypotheses()) sum += std::exp(h.log_weight);
      for (const auto& h : follower.hypotheses()) {
        robot.filters.push_back(h.filter);
        robot.weights.push_back(std::exp(h.log_weight) / sum);
      }
      robot.now_s = follower.last_s();
    }
  }
  /// Goes on to a time; all robots see each other on a raster.
  void go_to(double to_s) {
    constexpr double kRaster_s = 0.25;
    while (now_s_ < to_s - 1e-9) {
      see();
      const double next = neighbours_ ? std::min(to_s, now_s_ + kRaster_s) : to_s;
      advance(next);
      now_s_ = next;
    }
    advance(to_s);
  }
  bool expected(std::size_t place, Predicted& out) const {
    const Robot& robot = robots_[place];
    if (robot.filters.empty()) return false;
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
  };
  void see() {
    if (!neighbours_) return;
    locate();
    for (std::size_t r = 0; r < robots_.size(); ++r)
      if (!std::isnan(x_[r])) robots_[r].near = view_of(r, x_, y_);
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

  /// Robots that have come to overlap push each other away.
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
  std::vector<Robot> robots_;
  std::vector<double> x_, y_;
};

bool looks_at_neighbours(const MotionModel& model) {
  if (model.contacts) return true;
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

std::vector<Predicted> predict(const MotionModel& model, const PreparedSet& set, const Asked& asked,
                               bool held_out_only, std::uint32_t threads) {
  const std::vector<Run>& runs = set.set().runs;
  std::vector<std::vector<Predicted>> by_run(runs.size());
  const bool neighbours = looks_at_neighbours(model);
  in_parallel(runs.size(), threads, [&](std::size_t run) {
    std::vector<Follower> followers;
    double last_s = 0;
    bool wanted = false;
    for (const TrackView& view : set.views()) {
      if (view.run != run) continue;
      if (held_out_only && !view.track->held_out && !neighbours) continue;
      wanted = wanted || !held_out_only || view.track->held_out;
      followers.emplace_back(model, view);
      last_s = std::max(last_s, view.track->samples.back().time_s);
    }
    if (!wanted) return;
    const double first_s = std::max(asked.first_s, std::ceil(asked.horizon_s / asked.every_s) * asked.every_s);
    for (int k = 0;; ++k) {
      const double time_s = first_s + k * asked.every_s;
      if (time_s > last_s + 1e-6) break;
      const double from_s = time_s - asked.horizon_s;
      for (Follower& follower : followers) follower.follow(from_s);
      Outlook outlook(model, followers, from_s, neighbours);
      outlook.go_to(time_s);
      for (std::size_t i = 0; i < followers.size(); ++i) {
        const Track& track = *followers[i].view().track;
        if (held_out_only && !track.held_out) continue;
        Predicted p{static_cast<std::uint32_t>(run),
                    static_cast<std::uint32_t>(followers[i].view().place),
                    time_s,
                    0,
                    0,
                    0};
        if (outlook.expected(i, p)) by_run[run].push_back(p);
      }
    }
  });
  std::vector<Predicted> all;
  for (const auto& part : by_run) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace kilotwin::identify
