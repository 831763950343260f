#include "clients/identify/fit/fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "clients/identify/fit/noise_fit.hpp"
#include "clients/identify/fit/touched.hpp"
#include "clients/identify/model/picture_scale.hpp"
#include "clients/identify/model/rim.hpp"
#include "clients/identify/predict/follower.hpp"

namespace kilotwin::identify {
namespace {

struct LogLikelihood {
  double sum = 0;
  Touched touched;
  bool with_touching = false;  ///< what was measured after touching counts as well

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) { touched.step(record); }
  void update(const Innovation& innovation, const Sample&) {
    constexpr double kLeast = -1e3;
    const Touched::Counts counts = touched.update(innovation);
    if (counts == Touched::Counts::kAll || with_touching)
      sum += std::max(innovation.log_likelihood, kLeast);
    else if (counts == Touched::Counts::kHeading)
      sum += std::max(heading_log_likelihood(innovation), kLeast);
  }
};

/// Of one track, its robot's bias being known.
LogLikelihood likelihood_of(const MotionModel& model, const TrackView& view, bool with_touching = false) {
  RobotBias bias = model.bias_of(view.track->robot);
  bias.covariance.setZero();
  TrackFilter filter(model, bias, view.track->robot, view.number);
  LogLikelihood likelihood;
  likelihood.with_touching = with_touching;
  walk(filter, view, view.track->samples.size(), likelihood);
  return likelihood;
}

constexpr std::size_t kEnoughSamples = 8000;  ///< for noise

/// By how much, along an axis, robots were moved while they touched others, from the first measurement of that to the last.
struct Pushes {
  explicit Pushes(double tracker_mm2) : tracker_mm2_(tracker_mm2) {}
  double sum_mm2 = 0, time_s = 0;
  std::size_t count = 0;

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) {
    if (record.at_robot) touched_s_ += record.h_s;
  }
  void update(const Innovation& innovation, const Sample&) {
    const double touched_s = std::exchange(touched_s_, 0);
    if (touched_s > 0 && !innovation.lost) {
      way_ += std::sqrt(innovation.weight) * innovation.difference.head<2>();
      way_s_ += touched_s;
    } else if (way_s_ > 0) {
      // The tracker was off at either end.
      sum_mm2 += way_.squaredNorm() / 2 - 2 * tracker_mm2_;
      time_s += std::exchange(way_s_, 0);
      ++count;
      way_.setZero();
    }
  }

 private:
  double tracker_mm2_, touched_s_ = 0, way_s_ = 0;
  Eigen::Vector2d way_ = Eigen::Vector2d::Zero();
};

}  // namespace

double touching_mm(const BaseParameters& base, bool headings) {
  constexpr double kMostly = 0.75;
  return kTouch_mm + (headings ? 0 : kMostly * std::abs(base.centre_mm - base.ahead_mm));
}

PreparedSet::PreparedSet(const MeasuredSet& set, std::uint32_t first_number)
    : set_(&set), first_number_(first_number) {
  for (std::size_t r = 0; r < set.runs.size(); ++r) {
    neighbours_.push_back(std::make_unique<RunNeighbours>(set.runs[r]));
    neighbours_.back()->remember(set.runs[r], MotionModel{}.cells);
    for (std::size_t t = 0; t < set.runs[r].tracks.size(); ++t) {
      const Track& track = set.runs[r].tracks[t];
      if (track.samples.size() < 2) continue;
      const auto place = static_cast<std::uint32_t>(r);
      views_.push_back({&track, place, first_number + place, t, neighbours_.back().get(), CommandClock(track)});
    }
  }
  constexpr double kMargin_mm = 12;
  const Rim rim(set, kMargin_mm);
  for (TrackView& view : views_)
    for (const Sample& s : view.track->samples) view.at_rim.push_back(rim.holds(s.x_mm, s.y_mm));
}

std::vector<std::vector<const TrackView*>> PreparedSet::units() const {
  const std::vector<std::uint32_t> robots = set_->robots();
  constexpr std::size_t kFewRobots = 6;
  std::vector<std::vector<const TrackView*>> units(robots.size() < kFewRobots ? views_.size() : robots.size());
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].track->held_out) continue;
    const auto robot = std::lower_bound(robots.begin(), robots.end(), views_[v].track->robot) - robots.begin();
    units[robots.size() < kFewRobots ? v : static_cast<std::size_t>(robot)].push_back(&views_[v]);
  }
  std::erase_if(units, [](const auto& unit) { return unit.empty(); });
  return units;
}

void PreparedSet::find_centres(const MotionModel& model, std::uint32_t threads) {
  std::vector<Centres> centres(views_.size());
  in_parallel(views_.size(), threads, [&](std::size_t v) { centres[v] = centres_of(model, views_[v]); });
  for (std::size_t r = 0; r < neighbours_.size(); ++r) {
    // Tracks that are too short to be followed are where they were seen.
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
    *neighbours_[r] = RunNeighbours(set_->runs[r], &of_run);
    neighbours_[r]->remember(set_->runs[r], model.cells);
  }
}

void PreparedSet::remember(const MotionModel& model) {
  for (std::size_t r = 0; r < neighbours_.size(); ++r) neighbours_[r]->remember(set_->runs[r], model.cells);
}

Meetings PreparedSet::meetings() const {
  Meetings sum;
  constexpr double kEvery_s = 1;
  for (const TrackView& view : views_) {
    for (double t = view.track->samples.front().time_s; t < view.track->samples.back().time_s; t += kEvery_s) {
      const double nearest = view.neighbours->view(view.place, t).nearest_mm;
      if (nearest < Meetings::kInside_mm) ++sum.within;
      if (nearest > kTouch_mm && nearest < Meetings::kRing_mm) ++sum.near;
    }
  }
  return sum;
}

std::vector<Pair> PreparedSet::pairs() const {
  std::vector<Pair> pairs;
  for (std::size_t r = 0; r < neighbours_.size(); ++r)
    add_pairs(*neighbours_[r], set_->runs[r].tracks.size(), first_number_ + static_cast<std::uint32_t>(r), pairs);
  return pairs;
}

void PreparedSet::find_headings(const MotionModel& model, std::uint32_t threads) {
  in_parallel(views_.size(), threads, [&](std::size_t v) {
    TrackView& view = views_[v];
    const Sample& first = view.track->samples.front();
    if (TrackFilter::has_heading(first)) {
      view.start_heading_rad = first.heading_rad;
      view.start_heading_sd_rad = std::sqrt(model.noise.heading_rad2);
      return;
    }
    // As many samples as it takes to move a good way, and no more than these.
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
      walk(filter, view, samples + 1, likelihood);
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

std::vector<Block> blocks_of(const MotionModel& model) {
  std::vector<Block> blocks;
  for (const Term& term : model.terms) blocks.insert(blocks.end(), term.blocks.begin(), term.blocks.end());
  return blocks;
}

std::vector<const TrackView*> Fitter::some_tracks(std::size_t samples) const {
  std::vector<const TrackView*> chosen, all;
  for (const TrackView& view : set_.views())
    if (!view.track->held_out) all.push_back(&view);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < all.size() && sum < samples; ++i) {
    chosen.push_back(all[(i * 7919) % all.size()]);
    sum += chosen.back()->track->samples.size();
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

double Fitter::with_touching(const MotionModel& model, const std::vector<const TrackView*>& tracks) const {
  std::vector<double> sums(tracks.size());
  in_parallel(tracks.size(), threads_,
              [&](std::size_t i) { sums[i] = likelihood_of(model, *tracks[i], true).sum; });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

void Fitter::fit_touching(MotionModel& model) const {
  const std::vector<const TrackView*> tracks = some_tracks(kEnoughSamples);
  double best = with_touching(model, tracks);
  const auto climb = [&](double Noise::*part) {
    const double start = model.noise.*part;
    for (const double factor : {4.0, 0.25}) {
      bool better = true;
      while (better) {
        MotionModel trial = model;
        trial.noise.*part *= factor;
        if (trial.noise.*part < 1e-6 || trial.noise.*part > 1e3) break;
        const double value = with_touching(trial, tracks);
        better = value > best + 0.5;
        if (!better) break;
        best = value;
        model = trial;
      }
      if (model.noise.*part != start) break;
    }
  };
  for (double Noise::*const part : {&Noise::wall_mm2_s, &Noise::wall_rad2_s, &Noise::contact_mm2_s}) climb(part);
  // A robot is pushed one way for as long as it touches: as noise without a memory that looks like less than it adds up to, and
  // a turn, which does go on, would be blamed for the rest.
  if (const double lasting_mm2_s = lasting_push_mm2_s(model, tracks); lasting_mm2_s > model.noise.contact_mm2_s) {
    model.noise.contact_mm2_s = lasting_mm2_s;
    best = with_touching(model, tracks);
  }
  climb(&Noise::contact_rad2_s);
}

double Fitter::lasting_push_mm2_s(const MotionModel& model, const std::vector<const TrackView*>& tracks) const {
  std::vector<Pushes> pushes(tracks.size(), Pushes(model.noise.position_mm2));
  in_parallel(tracks.size(), threads_, [&](std::size_t i) {
    RobotBias bias = model.bias_of(tracks[i]->track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, tracks[i]->track->robot, tracks[i]->number);
    walk(filter, *tracks[i], tracks[i]->track->samples.size(), pushes[i]);
  });
  std::size_t count = 0;
  double sum_mm2 = 0, time_s = 0;
  for (const Pushes& p : pushes) {
    count += p.count;
    sum_mm2 += p.sum_mm2;
    time_s += p.time_s;
  }
  constexpr std::size_t kFew = 10;
  constexpr double kMost_mm2_s = 1e3;
  return count < kFew ? 0 : std::min(sum_mm2 / time_s, kMost_mm2_s);
}

void Fitter::find_shape(MotionModel& model) const {
  const bool headings = set_.set().has_headings;
  const std::vector<const TrackView*> tracks = some_tracks(kEnoughSamples);
  struct Candidate {
    MotionModel model;
    double log_likelihood = 0;
    Meetings meetings;
  };
  std::vector<Candidate> candidates;
  const auto add = [&](double centre_mm) {
    Candidate& c = candidates.emplace_back(Candidate{model, 0, {}});
    c.model.base.centre_mm = centre_mm;
    c.model.touch_mm = touching_mm(c.model.base, headings);
    set_.find_centres(c.model, threads_);
    if (headings) {
      c.model.room = room_of(set_, c.model);
    } else {
      find_walls(c.model);
      // Of what may touch more often less is known: with noise that is not its own it would look worse than it is.
      fit_touching(c.model);
    }
    c.log_likelihood = with_touching(c.model, tracks);
    c.meetings = set_.meetings();
  };
  add(kAxleOffset_mm);
  // Or the tracked point is the centre.
  constexpr double kApart_mm = 3;
  if (std::abs(model.base.ahead_mm - kAxleOffset_mm) > kApart_mm) add(model.base.ahead_mm);
  const Candidate* best = &candidates.front();
  for (const Candidate& c : candidates) {
    // Walls tell more than robots that met. Without walls the likelihood tells nothing: it would only count who is thought to touch.
    constexpr double kSure = 50;
    const bool walls = c.model.room.any() || best->model.room.any();
    const double better = walls ? c.log_likelihood - best->log_likelihood : 0;
    if (better > kSure || (better > -kSure && c.meetings.share_within() < 0.5 * best->meetings.share_within()))
      best = &c;
  }
  model = best->model;
  model.contacts = best->meetings.share_within() < Meetings::kUnhindered;
  if (best != &candidates.back()) set_.find_centres(model, threads_);
}

void Fitter::find_walls(MotionModel& model) const {
  // How far the tracked point may lie beyond the disc's centre, or before it.
  const double reach = std::abs(model.base.centre_mm - model.base.ahead_mm);
  // Where the tracked point was, by view and sample: not where a picture that is bent shows it.
  const bool measures = model.measures();
  const auto place_of = [&](const TrackView& view, const Sample& s) {
    if (!measures) return s;
    const Eigen::Vector3d pose = model.pose_of(s, view.at(s.time_s));
    const double c = std::cos(pose[2]), n = std::sin(pose[2]);
    return Sample{s.time_s, pose[0] + model.base.ahead_mm * c - model.base.left_mm * n,
                  pose[1] + model.base.ahead_mm * n + model.base.left_mm * c, pose[2]};
  };
  struct Side {
    double Room::*wall;
    double Sample::*along;
    double sign;
  };
  const std::array<Side, 4> sides = {
      Side{&Room::x_high_mm, &Sample::x_mm, 1}, Side{&Room::x_low_mm, &Sample::x_mm, -1},
      Side{&Room::y_high_mm, &Sample::y_mm, 1}, Side{&Room::y_low_mm, &Sample::y_mm, -1}};
  for (const Side& side : sides) {
    // Where headings are measured, discs that stay at one line have shown most walls already.
    if (set_.set().has_headings && std::isfinite(model.room.*side.wall)) continue;
    std::vector<double> places;
    for (const TrackView& view : set_.views())
      for (const Sample& s : view.track->samples) places.push_back(side.sign * place_of(view, s).*side.along);
    const std::size_t rank = places.size() - 1 - std::max<std::size_t>(3, places.size() / 2000);
    if (places.size() < 100) return;
    std::nth_element(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(rank), places.end());
    const double edge = places[rank];
    // Those that came near; of many, some.
    constexpr std::size_t kMost = 16;
    std::vector<const TrackView*> near;
    for (const TrackView& view : set_.views()) {
      if (view.track->held_out || near.size() == kMost) continue;
      const auto there = std::count_if(
          view.track->samples.begin(), view.track->samples.end(),
          [&](const Sample& s) { return std::abs(side.sign * place_of(view, s).*side.along - edge) < reach + 5; });
      if (there > 5) near.push_back(&view);
    }
    model.room.*side.wall = side.sign * std::numeric_limits<double>::infinity();
    if (near.empty()) continue;
    MotionModel best = model;
    // A wall has to be worth more than chance and bad luck with a few outliers.
    double best_value = with_touching(model, near) + 30;
    const auto try_at = [&](double wall) {
      MotionModel trial = model;
      trial.room.*side.wall = side.sign * wall;
      const double value = with_touching(trial, near);
      if (value <= best_value) return;
      best_value = value;
      best = trial;
    };
    for (double wall = edge - 2; wall <= edge + reach + 2; wall += 2) try_at(wall);
    const double found = side.sign * best.room.*side.wall;
    if (std::isinf(found)) continue;
    for (const double by : {-1.0, 1.0, -0.5, 0.5}) try_at(found + by);
    model = best;
  }
}

void Fitter::fit_noise(MotionModel& model) const {
  model.noise = most_likely_noise(model, some_tracks(kEnoughSamples), set_.set().has_headings, threads_);
}

void Fitter::add_base_prior(const MotionModel& model, Eigen::MatrixXd& information, Eigen::VectorXd& score) const {
  const BaseParameters seed;
  const auto add = [&](Eigen::Index i, double from, double sd) {
    information(i, i) += 1 / (sd * sd);
    score[i] += from / (sd * sd);
  };
  add(kStraightSpeed, seed.straight_mm_s - model.base.straight_mm_s, prior_.straight_mm_s);
  add(kTurnSpeed, seed.turn_mm_s - model.base.turn_mm_s, prior_.turn_mm_s);
  add(kWheelBase, seed.wheel_base_mm - model.base.wheel_base_mm, prior_.wheel_base_mm);
  add(kAheadPoint, seed.ahead_mm - model.base.ahead_mm, prior_.point_mm);
  add(kLeftPoint, seed.left_mm - model.base.left_mm, prior_.point_mm / 4);
}

void Fitter::apply(MotionModel& model, const std::vector<Unit>& units, const Eigen::VectorXd& step) {
  const auto limited = [](double value, double most) { return std::clamp(value, -most, most); };
  model.base.straight_mm_s += limited(step[kStraightSpeed], 20);
  model.base.turn_mm_s += limited(step[kTurnSpeed], 20);
  model.base.wheel_base_mm = std::clamp(model.base.wheel_base_mm + limited(step[kWheelBase], 3), 10.0, 60.0);
  model.base.ahead_mm += limited(step[kAheadPoint], 8);
  model.base.left_mm += limited(step[kLeftPoint], 8);
  Eigen::Index first = kBaseColumns;
  for (Term& term : model.terms) {
    term.coefficients += step.segment(first, term.coefficients.size());
    first += term.coefficients.size();
  }
  // A robot may be several units (tracks): its bias is their mean by precision.
  std::map<std::uint32_t, std::pair<Eigen::Matrix2d, Eigen::Vector2d>> sums;
  for (const Unit& unit : units) {
    const RobotBias was = model.bias_of(unit.robot);
    const Eigen::Vector2d bias = was.mean_mm_s + unit.bias_step - unit.bias_by_column * step;
    const Eigen::Matrix2d precision = unit.bias_covariance.inverse();
    auto [sum, made] = sums.try_emplace(unit.robot, Eigen::Matrix2d::Zero(), Eigen::Vector2d::Zero());
    sum->second.first += precision;
    sum->second.second += precision * bias;
  }
  double sum = 0, square = 0, count = 0;
  for (const auto& [robot, s] : sums) {
    RobotBias& bias = model.robots[robot];
    bias.covariance = s.first.inverse();
    bias.mean_mm_s = (bias.covariance * s.second).cwiseMax(-15).cwiseMin(15);
    sum += bias.mean_mm_s.sum();
    square += bias.mean_mm_s.squaredNorm() + bias.covariance.trace();
    count += 2;
  }
  // The distribution of biases, held near the seed's where robots are few.
  const BaseParameters seed;
  constexpr double kSeedRobots = 4;
  const double mean = sum / (count + kSeedRobots);
  const double variance =
      (square - 2 * mean * sum + count * mean * mean + kSeedRobots * seed.bias_sd_mm_s * seed.bias_sd_mm_s) /
      (count + kSeedRobots);
  model.base.bias_mean_mm_s = mean;
  model.base.bias_sd_mm_s = std::sqrt(std::max(variance, 0.01));
}

double Fitter::log_likelihood(const MotionModel& model) const {
  const std::vector<TrackView>& views = set_.views();
  std::vector<double> sums(views.size());
  in_parallel(views.size(), threads_, [&](std::size_t i) {
    if (views[i].track->held_out) return;
    sums[i] = likelihood_of(model, views[i]).sum;
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

double Fitter::log_likelihood_of_all(const MotionModel& model) const {
  return with_touching(model, some_tracks(std::numeric_limits<std::size_t>::max()));
}

double Fitter::log_evidence(const MotionModel& model) const {
  double value = log_likelihood(model);
  if (model.terms.empty()) return value;
  const std::vector<Unit> units = linearise(model, set_.units(), blocks_of(model), {100, threads_});
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(units[0].information.rows(), units[0].information.cols());
  for (const Unit& unit : units) information += unit.information;
  Eigen::VectorXd unused = Eigen::VectorXd::Zero(information.rows());
  add_base_prior(model, information, unused);
  const Eigen::Index n = information.rows() - kBaseColumns;
  Eigen::VectorXd sd(n);
  Eigen::Index first = 0;
  for (const Term& term : model.terms) {
    sd.segment(first, term.precision.size()) = term.precision.cwiseInverse().cwiseSqrt();
    value -= 0.5 * term.precision.dot(term.coefficients.cwiseAbs2());
    first += term.precision.size();
  }
  // Of the terms' coefficients, whatever the base parameters are.
  const Eigen::MatrixXd cross = information.topRightCorner(kBaseColumns, n);
  const Eigen::MatrixXd by = information.topLeftCorner<kBaseColumns, kBaseColumns>().ldlt().solve(cross);
  Eigen::MatrixXd posterior = information.bottomRightCorner(n, n) - cross.transpose() * by;
  posterior = (sd.asDiagonal() * posterior * sd.asDiagonal()).eval();
  posterior.diagonal().array() += 1;
  return value - Eigen::LLT<Eigen::MatrixXd>(posterior).matrixLLT().diagonal().array().log().sum();
}

void Fitter::fit_base(MotionModel& model) const {
  const bool headings = set_.set().has_headings;
  if (headings) {
    set_.find_headings(model, threads_);
  } else {
    // In a room that robots are hardly ever free in, a tracked point and walls that do not belong together hold each other
    // where they are: those that explain most to start with are taken, of either point that is likely to be tracked.
    const std::vector<const TrackView*> tracks = some_tracks(kEnoughSamples);
    const MotionModel given = model;
    double best = -1e300;
    for (const double ahead_mm : {0.0, given.base.ahead_mm}) {
      MotionModel start = given;
      start.base.ahead_mm = ahead_mm;
      start.touch_mm = touching_mm(start.base, headings);
      set_.find_headings(start, threads_);
      find_walls(start);
      const double value = with_touching(start, tracks);
      if (value <= best) continue;
      best = value;
      model = start;
    }
    set_.find_headings(model, threads_);
    // What is not known to be a push would pass for noise of the wheels.
    fit_touching(model);
  }
  fit(model, 3);
  find_shape(model);
  // Where headings are not measured, walls, centres and what touching does lean on each other.
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 20;
  double likelihood = -1e300;
  for (int round = 0; round < (headings ? 1 : kMostRounds); ++round) {
    if (headings || round > 0) find_walls(model);
    if (round > 0) set_.find_centres(model, threads_);
    fit_touching(model);
    fit(model, 2);
    const double found = log_likelihood(model);
    if (found < likelihood + kSettled) break;
    likelihood = found;
  }
  if (holds_seem_elsewhere(model)) {
    model = doubting(model);
    fit(model, 2);
  }
}

void Fitter::fit_surroundings(MotionModel& model) const {
  if (model.doubts_rim) settle_doubts(model);
  // With much noise at walls it would not matter where they are.
  const Noise anew;
  for (double Noise::*const part :
       {&Noise::wall_mm2_s, &Noise::wall_rad2_s, &Noise::contact_mm2_s, &Noise::contact_rad2_s})
    model.noise.*part = anew.*part;
  const bool headings = set_.set().has_headings;
  // What a model lacked may have passed for a disc that lies elsewhere.
  if (!headings) find_shape(model);
  for (int round = 0; round < (headings ? 1 : 2); ++round) {
    if (headings || round > 0) {
      find_walls(model);
      set_.find_centres(model, threads_);
    }
    if (model.measures() && set_scale(model)) set_.find_centres(model, threads_);
    // In a picture that is bent robots seem to meet where they do not.
    if (model.measures() && !model.doubts_rim)
      model.contacts = set_.meetings().share_within() < Meetings::kUnhindered;
    fit_touching(model);
    fit(model, 1);
  }
}

bool Fitter::set_scale(MotionModel& model) const {
  constexpr double kNear = 0.15, kSame = 0.001;
  const std::vector<Pair> pairs = set_.pairs();
  const std::optional<TouchingApart> apart = touching_apart(pairs);
  hold_.reset();
  if (!apart || std::abs(apart->mm / kDiscs_mm - 1) > kNear) return false;
  const double factor = kDiscs_mm / apart->mm;
  if (!rescale(model, factor)) return false;
  std::vector<Pair> met;
  for (Pair pair : pairs)
    if (std::abs(pair.apart_mm - apart->mm) < 2) met.push_back(pair);
  hold_ = std::make_shared<const ScaleHold>(model, met, apart->sd_mm / kDiscs_mm);
  return std::abs(factor - 1) > kSame;
}

void Fitter::settle_scale(MotionModel& model) const {
  // Where it is least surprising by the seed's lengths, beforehand normal each: a square in the factor.
  const BaseParameters seed;
  // An effect on speed leaves open at which value of its covariates robots have the seed's.
  constexpr double kByEffects = 0.5;
  const bool nominal = std::none_of(model.terms.begin(), model.terms.end(), [](const Term& term) {
    return std::any_of(term.blocks.begin(), term.blocks.end(),
                       [](const Block& block) { return !is_measured(block.target); });
  });
  const auto speed_sd = [&](double sd, double value) { return nominal ? sd : std::hypot(sd, kByEffects * value); };
  double by_seed = 0, precision = 0;
  for (const auto& [value, expected, sd] :
       {std::array{model.base.straight_mm_s, seed.straight_mm_s,
                   speed_sd(prior_.straight_mm_s, seed.straight_mm_s)},
        std::array{model.base.turn_mm_s, seed.turn_mm_s, speed_sd(prior_.turn_mm_s, seed.turn_mm_s)},
        std::array{model.base.wheel_base_mm, seed.wheel_base_mm, prior_.wheel_base_mm}}) {
    by_seed += value * expected / (sd * sd);
    precision += value * value / (sd * sd);
  }
  if (by_seed <= 0) return;
  double log_factor = precision * std::log(by_seed / precision);
  if (hold_) {
    const double sure = 1 / (hold_->relative_sd() * hold_->relative_sd());
    log_factor += sure * std::log(hold_->factor(model));
    precision += sure;
  }
  rescale(model, std::exp(log_factor / precision));
}

void Fitter::fit(MotionModel& model, int passes) const {
  // With a new map of the picture, all that was seen of walls and of who meets whom is to be seen anew.
  const bool new_picture = !model.terms.empty() && is_map_of_picture(model.terms.back());
  if (passes > 1 && new_picture) straighten(model);
  for (int pass = 0; pass < passes; ++pass) {
    set_.find_headings(model, threads_);
    look_for_walls(model);
    // What was noise to a model without its new terms is not, once they have their size.
    if (pass != 0 || passes == 1) fit_noise(model);
    step(model);
  }
}

}  // namespace kilotwin::identify
