#include "tests/identify/truth/laboratories.hpp"

namespace kilotwin::truth {

Scene tidy_lab() { return {}; }

Scene blind_lab() {
  Scene s;
  s.heading = false;
  s.tracked_ahead_mm = 0;
  s.tracker_sd_mm = 0.6;
  return s;
}

Scene poor_lab() {
  Scene s;
  s.heading = false;
  s.jitter = 0.4;
  s.missing = 0.15;
  s.gap_share = 0.3;
  s.tracker_sd_mm = 0.8;
  return s;
}

Scene plain_lab() {
  Scene s;
  s.disc_ahead_mm = s.tracked_ahead_mm = 0;
  s.width_mm = s.height_mm = 0;
  s.factor_sd = 0.08;
  s.heading_sd_rad = 0.02;
  s.bias_sd_mm_s = 1.86;
  return s;
}

Scene crowded_lab() {
  Scene s;
  s.robots = 24;
  s.width_mm = s.height_mm = 480;
  s.train_runs = 3;
  s.train_s = 150;
  s.test_s = 90;
  return s;
}

Scene brisk_lab() {
  Scene s;
  s.sample_s = 0.25;
  s.jitter = 0.2;
  s.tracker_sd_mm = 0.3;
  s.heading_sd_rad = 0.06;
  return s;
}

Scene sparse_lab() {
  Scene s;
  s.heading = false;
  s.sample_s = 1;
  s.width_mm = 1200;
  s.height_mm = 560;
  s.tracker_sd_mm = 0.5;
  return s;
}

Scene small_lab() {
  Scene s;
  s.robots = 5;
  s.train_runs = 4;
  s.sample_s = 1;
  s.gap_share = 0.3;
  s.width_mm = s.height_mm = 600;
  return s;
}

Scene late_lab() {
  Scene s;
  s.commands_late_s = 0.4;
  return s;
}

}  // namespace kilotwin::truth
