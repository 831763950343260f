/// A robot's filter while it is led along its track, with nothing of the future known; several filters while nobody knows which
/// way the robot points.
#pragma once

#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

class Follower {
 public:
  /// Both must outlive it.
  Follower(const MotionModel& model, const TrackView& view) : model_(model), view_(view) {}

  /// Takes in all samples up to this time.
  void follow(double to_s);
  [[nodiscard]] bool started() const { return next_ > 0; }
  /// Of the last sample that was taken in.
  [[nodiscard]] double last_s() const { return view_.track->samples[next_ - 1].time_s; }

  struct Hypothesis {
    TrackFilter filter;
    double log_weight = 0;
  };
  [[nodiscard]] const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  [[nodiscard]] const TrackView& view() const { return view_; }
  /// Of all that was taken in.
  [[nodiscard]] double log_likelihood() const { return log_likelihood_; }

 private:
  void take(const Sample&);
  void start(const Sample&);
  void prune();

  const MotionModel& model_;
  const TrackView& view_;
  std::vector<Hypothesis> hypotheses_;
  std::size_t next_ = 0;
  double log_likelihood_ = 0;
};

/// Each by all that was measured until then.
[[nodiscard]] Centres centres_of(const MotionModel&, const TrackView&);

}  // namespace kilotwin::identify
