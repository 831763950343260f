/// One picture of a movie: the arena with its robots, their trails and the time, as SVG.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "clients/recorder/ground.hpp"
#include "clients/recorder/overview.hpp"
#include "clients/recorder/view.hpp"

namespace kilotwin::movie {

struct Look {
  int width_px = 1280, height_px = 720;
  double trail_s = 10;       ///< simulated time that trails reach back; 0: none
  std::string caption;       ///< a line below the arena; may be empty
  double times_real = 1;     ///< simulated time per time of the movie
  bool whole_arena = false;  ///< also where the robots take up a small part of it
};

/// Positions of all robots at one time.
struct Positions {
  double time_s = 0;
  std::vector<recorder::Point> points;
};

/// The recent positions of all robots: at most 80 times, whatever the number of frames.
class Trails {
 public:
  explicit Trails(double trail_s) : trail_s_(trail_s) {}
  void add(const recorder::Snapshot& at);
  [[nodiscard]] const std::deque<Positions>& positions() const { return positions_; }

 private:
  double trail_s_;
  std::deque<Positions> positions_;
};

class FrameArtist {
 public:
  /// The run must outlive it.
  FrameArtist(const recorder::RunOverview& run, Look look);

  /// Safe to call from several threads.
  [[nodiscard]] std::string svg(const recorder::Snapshot& at, const recorder::Floors& floors,
                                const std::deque<Positions>& trails) const;

 private:
  [[nodiscard]] std::string draw_trails(const std::deque<Positions>& trails, const recorder::Snapshot& at) const;
  [[nodiscard]] std::string draw_time(double time_s, double baseline_px) const;

  Look look_;
  recorder::Ground ground_;
  recorder::View view_;
  std::string name_, facts_;
  std::vector<double> cell_mm_;  ///< as in RunOverview
  double first_s_, last_s_;
};

}  // namespace kilotwin::movie
