/// How well what a robot does fits what robots are told to do: by how fast they go and how they turn under each command, over
/// all of a set. It knows no model and no robot's own bias; it serves to tell whose commands, and at what times, a track follows.
#pragma once

#include <array>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// A robot between two positions about a second apart.
struct Deed {
  double time_s;  ///< halfway
  double speed_mm_s;
  double curve_mm2_s2;  ///< cross product of the velocity before and after: positive where it bends to the left
};

[[nodiscard]] std::vector<Deed> deeds_of(const Track&);

class ToldAndDone {
 public:
  /// What deeds look like under each command. Tracks of few samples, and robots told nothing, count for nothing.
  explicit ToldAndDone(const MeasuredSet&);

  /// Log-likelihood of a deed under a command, up to a constant; bounded below, as robots do get stuck.
  [[nodiscard]] double log_likelihood(const Deed&, Motion) const;
  /// Whether commands differ in what they make robots do.
  [[nodiscard]] bool tells() const { return tells_; }

 private:
  struct Spread {
    double middle = 0, sd = 1;
  };
  std::array<Spread, 4> speed_, curve_;
  std::array<bool, 4> known_{};
  bool tells_ = false;
};

/// The command at a time.
[[nodiscard]] Motion told_at(const Track&, double time_s);

}  // namespace kilotwin::identify
