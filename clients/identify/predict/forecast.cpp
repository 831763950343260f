#include "clients/identify/predict/forecast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>

#include "clients/identify/fit/filter_bank.hpp"
#include "clients/identify/predict/rollout.hpp"
#include "clients/identify/predict/run_amplitude.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Places where a fine map of the floor changes steeply.
class Edges {
 public:
  explicit Edges(const MotionModel& model) {
    for (const Term& term : model.terms)
      for (const Block& block : term.blocks)
        // The last factor of a product is its map.
        if (!block.basis.factors.empty() && block.basis.factors.back().shape == Factor::Shape::kGrid)
          maps_.push_back(&block.basis.factors.back());
  }
  [[nodiscard]] bool any() const { return !maps_.empty(); }
  [[nodiscard]] bool near(double x_mm, double y_mm, double reach_mm) const {
    constexpr double kMuch = 0.1;  // relative to the robot's speed
    for (const Factor* const map : maps_) {
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
  std::vector<const Factor*> maps_;
};

/// Forecasts of the robots of one run, from an instant on by their commands alone.
class JointForecast {
 public:
  /// `sample_s`: of a track, the instant of a sample, at which its position is predicted, too.
  template <class SampleTime>
  JointForecast(const MotionModel& model, const std::vector<const FilterBank*>& banks, const TrafficGrids& grids,
                double from_s, bool neighbours, const SampleTime& sample_s)
      : model_(model),
        neighbours_(neighbours),
        now_s_(from_s),
        edges_(model),
        grids_(grids),
        initial_grids_(grids) {
    for (const FilterBank* const bank : banks) {
      Robot& robot = robots_.emplace_back();
      robot.view = &bank->view();
      if (!bank->started()) continue;
      // Most horizons have no spell, and in some a robot stands for long: no normal distribution describes that.
      robot.needs_rollout = model.stalls.has_value();
      double sum = 0;
      for (const auto& h : bank->hypotheses()) sum += std::exp(h.log_weight);
      for (const auto& h : bank->hypotheses()) {
        robot.filters.push_back(h.filter);
        robot.weights.push_back(std::exp(h.log_weight) / sum);
      }
      robot.now_s = bank->last_s();
      robot.sample_s = sample_s(bank->view());
      RolloutStart& start = robot.start;
      start.view = robot.view;
      start.weights = robot.weights;
      for (const auto& h : bank->hypotheses()) {
        start.filters.push_back(&h.filter);
        start.spells.push_back(h.spell);
      }
      start.now_s = robot.now_s;
    }
  }
  /// Advances to a time. Robots see each other on a time raster.
  void advance_to(double to_s) {
    // Raster, as of RunNeighbours; a finer one costs time, a coarser one shows older places.
    constexpr double kRaster_s = 0.25;
    end_s_ = to_s;
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
  void draw_rollouts(double from_s, std::uint32_t count, bool all, std::array<std::uint32_t, 2> key) {
    std::vector<RolloutStart> together;
    std::vector<std::size_t> who;
    bool any = false;
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      if (robots_[r].filters.empty()) continue;
      any = any || robots_[r].needs_rollout;
      if (!all && !robots_[r].needs_rollout) continue;
      together.push_back(robots_[r].start);
      who.push_back(r);
    }
    if (!any) return;
    const std::vector<RolloutMoments> seen =
        rollouts(model_, together, initial_grids_, from_s, now_s_, count, all, key);
    for (std::size_t i = 0; i < who.size(); ++i)
      if (robots_[who[i]].needs_rollout) robots_[who[i]].moments = seen[i];
  }
  bool expected(std::size_t place, Forecast& out) const {
    const Robot& robot = robots_[place];
    if (robot.filters.empty()) return false;
    expect_end(robot, out);
    set_sample(robot, out);
    return true;
  }

 private:
  struct Robot {
    const TrackView* view = nullptr;
    std::vector<TrackFilter> filters;
    std::vector<double> weights;
    double now_s = 0;
    NeighbourView near;
    RolloutStart start;
    bool needs_rollout = false;  ///< the mean of the futures is not the future of the mean
    std::optional<RolloutMoments> moments;
    double sample_s = std::numeric_limits<double>::quiet_NaN();
    std::optional<Eigen::Vector2d> at_sample_mm;  ///< mean path, before the end
  };
  /// Samples nearer to the predicted time are taken as measured at it.
  static constexpr double kSame_s = 0.01;
  /// The mean path at a time within a step, with the robot's present view of its neighbours.
  static Eigen::Vector2d path_at(const Robot& robot, double time_s) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < robot.filters.size(); ++i) {
      TrackFilter ahead = robot.filters[i];
      sub_steps(*robot.view->clock, robot.now_s, time_s, [&](double t, double h, const CommandState& commands) {
        ahead.step_mean(t, h, commands, robot.near);
      });
      mean += robot.weights[i] * ahead.expected(time_s, robot.view->clock->at(time_s - 1e-9)).head<2>();
    }
    return mean;
  }
  /// The prediction at the sample: that at the end, shifted along the mean path.
  void set_sample(const Robot& robot, Forecast& out) const {
    out.sample_s = robot.sample_s;
    out.sample_x_mm = out.x_mm;
    out.sample_y_mm = out.y_mm;
    if (std::isnan(robot.sample_s) || std::abs(robot.sample_s - now_s_) <= kSame_s) return;
    const Eigen::Vector2d shift_mm =
        (robot.at_sample_mm ? *robot.at_sample_mm : path_at(robot, robot.sample_s)) - path_at(robot, robot.now_s);
    out.sample_x_mm += shift_mm[0];
    out.sample_y_mm += shift_mm[1];
  }
  void expect_end(const Robot& robot, Forecast& out) const {
    if (robot.moments) {
      out.x_mm = robot.moments->x_mm;
      out.y_mm = robot.moments->y_mm;
      out.expected_error_mm = std::sqrt(robot.moments->square_mm2 + 2 * model_.noise.position_mm2);
      return;
    }
    const CommandState commands = robot.view->clock->at(now_s_ - 1e-9);
    double x = 0, y = 0, square = 0, spread = 0;
    for (std::size_t i = 0; i < robot.filters.size(); ++i) {
      const Eigen::Vector3d seen = robot.filters[i].expected(now_s_, commands);
      x += robot.weights[i] * seen[0];
      y += robot.weights[i] * seen[1];
      square += robot.weights[i] * seen.head<2>().squaredNorm();
      spread += robot.weights[i] * robot.filters[i].predicted_variance_mm2(now_s_, commands);
    }
    out.x_mm = x;
    out.y_mm = y;
    out.expected_error_mm =
        std::sqrt(spread + std::max(0.0, square - x * x - y * y) + 2 * model_.noise.position_mm2);
  }
  /// Updates neighbour views and traffic, for the next `for_s`.
  void see(double for_s) {
    if (!neighbours_) return;
    locate();
    list_.clear();
    who_.clear();
    for (const Robot& robot : robots_)
      who_.push_back({robot.view->track->robot, robot.view->clock->at(now_s_).driven()});
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      robots_[r].near = {};
      if (std::isnan(x_[r])) continue;
      robots_[r].near = view_of(r, x_, y_, &list_, who_);
      const StateCovariance& p = robots_[r].filters.front().belief().covariance;
      const double uncertain = 1.5 * std::sqrt(p(0, 0) + p(1, 1));
      if (model_.contacts && robots_[r].near.nearest_mm < model_.contact_range_mm + std::min(uncertain, 20.0))
        robots_[r].needs_rollout = true;
      // With traffic grids, effects change from cell to cell: the mean path does not suffice.
      if (grids_.any()) robots_[r].needs_rollout = true;
      if (!robots_[r].needs_rollout)
        robots_[r].needs_rollout = edges_.near(x_[r], y_[r], std::clamp(uncertain, 6.0, 30.0));
      grids_.see(robots_[r].view->place, x_[r], y_[r], now_s_, robots_[r].near);
    }
    for (std::size_t r = 0; grids_.any() && r < robots_.size(); ++r)
      if (!std::isnan(x_[r]) && robots_[r].view->clock->at(now_s_).driven())
        grids_.add(robots_[r].view->place, x_[r], y_[r], for_s, now_s_);
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
      if (!robot.filters.empty() && robot.now_s < robot.sample_s && robot.sample_s <= to_s &&
          robot.sample_s < end_s_ - kSame_s)
        robot.at_sample_mm = path_at(robot, robot.sample_s);
      for (TrackFilter& filter : robot.filters)
        sub_steps(*robot.view->clock, robot.now_s, to_s, [&](double t, double h, const CommandState& commands) {
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
        filter.belief().mean[0] += model_.walls.inside_x(x_[r]) - x[r];
        filter.belief().mean[1] += model_.walls.inside_y(y_[r]) - y[r];
      }
    }
  }

  const MotionModel& model_;
  const bool neighbours_;
  double now_s_, end_s_ = 0;
  const Edges edges_;
  TrafficGrids grids_;
  const TrafficGrids& initial_grids_;
  std::vector<Robot> robots_;
  std::vector<double> x_, y_;
  std::vector<Neighbour> who_;    ///< all robots as neighbours
  std::vector<OtherRobot> list_;  ///< neighbours of all robots
};

/// Traffic of a run, by the measurements so far.
class TrafficRecord {
 public:
  TrafficRecord(const MotionModel& model, std::size_t robots) : known_(model), next_(robots, 0) {}

  [[nodiscard]] TrafficGrids at(double now_s, const std::vector<const FilterBank*>& banks) {
    for (std::size_t f = 0; known_.any() && f < banks.size(); ++f) {
      if (!banks[f]->started()) continue;
      const auto [near, place] = of(*banks[f]);
      for (std::size_t& i = next_[f]; i < near->instants() && is_before(near->time_s(i), banks[f]->last_s(), now_s);
           ++i)
        add(place, near->spot(place, i), near->time_s(i), known_);
    }
    TrafficGrids now = known_;
    // From their last samples on, robots count as standing there.
    for (std::size_t f = 0; known_.any() && f < banks.size(); ++f) {
      if (!banks[f]->started() || next_[f] == 0) continue;
      const auto [near, place] = of(*banks[f]);
      RunNeighbours::Spot last = near->spot(place, next_[f] - 1);
      for (std::size_t i = next_[f]; i < near->instants() && near->time_s(i) < now_s - 1e-6; ++i) {
        last.driven = banks[f]->view().clock->at(near->time_s(i) + 1e-9).driven();
        add(place, last, near->time_s(i), now);
      }
    }
    return now;
  }

 private:
  static std::pair<const RunNeighbours*, std::size_t> of(const FilterBank& bank) {
    return {bank.view().neighbours, bank.view().place};
  }
  static bool is_before(double time_s, double seen_s, double now_s) {
    return time_s <= seen_s + 1e-6 && time_s < now_s - 1e-6;
  }
  static void add(std::size_t robot, const RunNeighbours::Spot& spot, double time_s, TrafficGrids& to) {
    if (!std::isnan(spot.x_mm) && spot.driven)
      to.add(robot, spot.x_mm, spot.y_mm, RunNeighbours::kRaster_s, time_s);
  }
  TrafficGrids known_;
  std::vector<std::size_t> next_;  ///< first instant that is not added yet
};

/// The end of a run is unknown. It may last until the next frame, which need not exist.
double end_of(const std::vector<Sample>& samples) {
  constexpr double kFrames = 2;  // mean intervals between samples; a larger value predicts beyond the end of a run
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

const Sample* sample_near(const Track& track, double time_s, double reach_s) {
  const auto after = std::lower_bound(track.samples.begin(), track.samples.end(), time_s,
                                      [](const Sample& s, double t) { return s.time_s < t; });
  const Sample* nearest = after == track.samples.end() ? nullptr : &*after;
  if (after != track.samples.begin()) {
    const Sample* const before = &*std::prev(after);
    if (nearest == nullptr || time_s - before->time_s <= nearest->time_s - time_s) nearest = before;
  }
  return nearest != nullptr && std::abs(nearest->time_s - time_s) <= reach_s ? nearest : nullptr;
}

std::optional<Eigen::Vector2d> error_of(const Track& track, const Forecast& f) {
  constexpr double kSame_s = 1e-9;  // rounding of times
  if (std::isnan(f.sample_s)) return std::nullopt;
  const Sample* const seen = sample_near(track, f.sample_s, kSame_s);
  if (seen == nullptr) return std::nullopt;
  return Eigen::Vector2d(seen->x_mm - f.sample_x_mm, seen->y_mm - f.sample_y_mm);
}

namespace {

/// A run under one of the models with different run amplitudes.
struct RunModel {
  RunModel(const MotionModel& of, const std::vector<const TrackView*>& views)
      : model(of), traffic(model, views.size()) {
    banks.reserve(views.size());
    for (const TrackView* view : views) banks.emplace_back(model, *view);
  }
  RunModel(const RunModel&) = delete;

  const MotionModel model;
  std::vector<FilterBank> banks;
  TrafficRecord traffic;
};

/// Forecasts of one run. The filters take the measurements up to each start in turn; from there the forecasts are
/// independent of each other.
class RunForecasts {
 public:
  RunForecasts(const MotionModel& model, std::vector<const TrackView*> views, const ForecastTimes& times,
               os::WorkerPool& pool)
      : views_(std::move(views)),
        times_(times),
        pool_(pool),
        all_(looks_at_neighbours(model)),
        neighbours_(needs_neighbours(model)),
        amplitude_(model, views_.front()->number) {
    for (const MotionModel& one : amplitude_.models()) models_.emplace_back(one, views_);
  }
  static bool needs_neighbours(const MotionModel& model) {
    return looks_at_neighbours(model) || model.contacts || TrafficGrids(model).any() || Edges(model).any();
  }
  /// Of the tracks that count, by instant.
  std::vector<Forecast> forecasts(Tracks of) {
    double last_s = 0;
    for (const TrackView* const view : views_) last_s = std::max(last_s, end_of(view->track->samples));
    std::vector<double> instants_s;
    for (int k = 0; first_s() + k * times_.every_s <= last_s + 1e-6; ++k)
      instants_s.push_back(first_s() + k * times_.every_s);
    std::vector<Forecast> out;
    // The states of the filters at a few starts at a time bound the memory.
    const std::size_t together = std::size_t{8} * pool_.threads();
    for (std::size_t first = 0; first < instants_s.size(); first += together) {
      const std::vector<Start> starts = starts_of(
          first, std::vector(instants_s.begin() + static_cast<std::ptrdiff_t>(first),
                             instants_s.begin() +
                                 static_cast<std::ptrdiff_t>(std::min(first + together, instants_s.size()))));
      std::vector<std::vector<Forecast>> seen(starts.size());
      pool_.for_each(starts.size(), [&](std::size_t k) { seen[k] = forecasts_from(starts[k]); });
      for (const std::vector<Forecast>& at_instant : seen)
        for (std::size_t i = 0; i < at_instant.size(); ++i)
          if (!std::isnan(at_instant[i].x_mm) && counts(*views_[i]->track, of)) out.push_back(at_instant[i]);
    }
    return out;
  }

 private:
  /// One of the models at a start.
  struct Known {
    const MotionModel* model;
    std::vector<FilterBank> banks;
    TrafficGrids grids;
    std::shared_ptr<const MotionModel> own = nullptr;  ///< the model of a drifting amplitude
    [[nodiscard]] std::vector<const FilterBank*> pointers() const {
      std::vector<const FilterBank*> all;
      for (const FilterBank& bank : banks) all.push_back(&bank);
      return all;
    }
  };
  /// A start, with the one or two models between whose forecasts the result lies. A drifting amplitude has one.
  struct Start {
    double time_s;  ///< that is predicted
    std::uint32_t number;
    std::vector<Known> known;
    double part = 0;  ///< of the second
  };
  [[nodiscard]] double first_s() const {
    return std::max(times_.first_s, std::ceil(times_.horizon_s / times_.every_s) * times_.every_s);
  }
  std::vector<Start> starts_of(std::size_t first, const std::vector<double>& instants_s) {
    const std::size_t robots = views_.size();
    std::vector<std::vector<FilterBank>> states(models_.size() * robots);  // by model and robot, then by instant
    pool_.for_each(states.size(), [&](std::size_t i) {
      FilterBank& bank = models_[i / robots].banks[i % robots];
      states[i].reserve(instants_s.size());
      for (const double time_s : instants_s) {
        bank.advance_to(time_s - times_.horizon_s);
        states[i].push_back(bank);
      }
    });
    std::vector<Start> starts;
    for (std::size_t k = 0; k < instants_s.size(); ++k) {
      std::vector<double> log_likelihood(models_.size(), 0.0);
      for (std::size_t i = 0; i < states.size(); ++i) log_likelihood[i / robots] += states[i][k].log_likelihood();
      const double now_s = instants_s[k] - times_.horizon_s;
      DriftingAmplitude::Known amplitude;
      if (models_.size() > 1) {
        amplitude = drifting_.at(now_s, times_.horizon_s, log_likelihood);
        follow(amplitude.passed, now_s);
      }
      const RunAmplitude::Between& between = amplitude.constant;
      Start& start =
          starts.emplace_back(Start{instants_s[k], static_cast<std::uint32_t>(first + k), {}, between.part});
      if (amplitude.ahead) {
        start.known.push_back(followed(*amplitude.ahead, now_s));
        continue;
      }
      const auto add = [&](std::size_t m) {
        std::vector<FilterBank> banks;
        banks.reserve(robots);
        for (std::size_t r = 0; r < robots; ++r) banks.push_back(std::move(states[m * robots + r][k]));
        Known& known =
            start.known.emplace_back(Known{&models_[m].model, std::move(banks), TrafficGrids(models_[m].model)});
        known.grids = models_[m].traffic.at(now_s, known.pointers());
      };
      add(between.low);
      if (between.high != between.low) add(between.high);
    }
    return starts;
  }
  /// Carries the filters of a drifting amplitude on to an instant. It was at this place of the raster since the last one.
  void follow(double place, double to_s) {
    auto model = std::make_shared<const MotionModel>(amplitude_.model_at(place));
    if (followed_.empty())
      for (const TrackView* view : views_) followed_.emplace_back(*model, *view);
    pool_.for_each(followed_.size(), [&](std::size_t i) {
      followed_[i].take_model(*model);
      followed_[i].advance_to(to_s);
    });
    followed_model_ = std::move(model);
  }
  /// The filters of a drifting amplitude, under the model of its mean ahead.
  Known followed(double place, double now_s) {
    auto model = std::make_shared<const MotionModel>(amplitude_.model_at(place));
    Known known{model.get(), followed_, TrafficGrids(*model), model};
    for (FilterBank& bank : known.banks) bank.take_model(*model);
    known.grids = models_.front().traffic.at(now_s, known.pointers());
    return known;
  }
  [[nodiscard]] std::vector<Forecast> forecasts_from(const Start& start) const {
    std::vector<Forecast> seen = forecasts_by(start.known.front(), start);
    if (start.known.size() == 1) return seen;
    const std::vector<Forecast> high = forecasts_by(start.known.back(), start);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      for (double Forecast::*const number : {&Forecast::x_mm, &Forecast::y_mm, &Forecast::expected_error_mm,
                                             &Forecast::sample_x_mm, &Forecast::sample_y_mm})
        seen[i].*number += start.part * (high[i].*number - seen[i].*number);
    }
    return seen;
  }
  /// By track. NaN: no forecast.
  [[nodiscard]] std::vector<Forecast> forecasts_by(const Known& known, const Start& start) const {
    const double from_s = start.time_s - times_.horizon_s;
    const auto sample_s = [&](const TrackView& view) {
      const Sample* const near = sample_near(*view.track, start.time_s, kNear * (start.time_s - from_s));
      return near != nullptr ? near->time_s : std::numeric_limits<double>::quiet_NaN();
    };
    const MotionModel& model = *known.model;
    JointForecast joint(model, known.pointers(), known.grids, from_s, neighbours_, sample_s);
    joint.advance_to(start.time_s);
    if (times_.rollouts > 0 && (model.contacts || model.stalls || known.grids.any() || Edges(model).any()))
      joint.draw_rollouts(from_s, times_.rollouts, all_, {views_.front()->run, start.number});
    std::vector<Forecast> out;
    for (std::size_t i = 0; i < known.banks.size(); ++i) {
      const TrackView& view = *views_[i];
      Forecast p{view.run, static_cast<std::uint32_t>(view.place), start.time_s, 0, 0, 0};
      if (!joint.expected(i, p)) p.x_mm = std::nan("");
      if (known.banks[i].started()) set_start(known.banks[i], p);
      out.push_back(p);
    }
    return out;
  }
  /// The most likely hypothesis at the start of the horizon.
  static void set_start(const FilterBank& bank, Forecast& to) {
    const auto best = std::max_element(bank.hypotheses().begin(), bank.hypotheses().end(),
                                       [](const auto& a, const auto& b) { return a.log_weight < b.log_weight; });
    const Belief& belief = best->filter.belief();
    to.from_x_mm = belief.centre_x_mm();
    to.from_y_mm = belief.centre_y_mm();
    to.from_heading_rad = belief.mean[2];
  }

  const std::vector<const TrackView*> views_;
  const ForecastTimes times_;
  os::WorkerPool& pool_;
  const bool all_, neighbours_;
  const RunAmplitude amplitude_;
  DriftingAmplitude drifting_{amplitude_};
  std::vector<FilterBank> followed_;  ///< under the amplitude as it was at each time, as far as it was known then
  std::shared_ptr<const MotionModel> followed_model_;
  std::deque<RunModel> models_;
};

}  // namespace

std::vector<Forecast> forecast(const MotionModel& model, const PreparedSet& set, const ForecastTimes& times,
                               Tracks of, std::uint32_t threads) {
  const bool neighbours = RunForecasts::needs_neighbours(model);
  os::WorkerPool pool(threads);
  std::vector<Forecast> all;
  for (std::size_t run = 0; run < set.set().runs.size(); ++run) {
    std::vector<const TrackView*> views;
    bool wanted = false;
    for (const TrackView& view : set.views()) {
      if (view.run != run) continue;
      const bool counted = counts(*view.track, of);
      wanted = wanted || counted;
      if (counted || neighbours) views.push_back(&view);
    }
    if (!wanted) continue;
    const std::vector<Forecast> of_run = RunForecasts(model, std::move(views), times, pool).forecasts(of);
    all.insert(all.end(), of_run.begin(), of_run.end());
  }
  return all;
}

}  // namespace kilotwin::identify
