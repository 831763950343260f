// The whole tracker on rendered pictures of robots that drive: positions, headings and colours against the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/clients/track/film.hpp"

namespace kilotwin::track {
namespace {

/// Errors of one film.
struct Errors {
  double position = 0, heading = 0, straight = 0;
  int positions = 0, headings = 0, straights = 0;
  int led_all = 0, led_right = 0, unmatched = 0, doubts = 0;
  std::size_t tracks = 0;
};

void judge(const std::vector<TrackedRobot>& seen, const std::vector<Driver>& robots, double t, Errors& errors) {
  std::set<const Driver*> used;
  for (const TrackedRobot& one : seen) {
    if (one.state != TrackState::kSeen && one.state != TrackState::kDoubt) continue;
    double off = 0;
    const Driver* robot = robot_at(robots, one.position, &off);
    if (robot == nullptr || !used.insert(robot).second) {
      ++errors.unmatched;
      continue;
    }
    errors.position += off * off;
    ++errors.positions;
    if (t - robot->led_since_s > 0.3) {
      ++errors.led_all;
      errors.led_right += bits_of(one.led) == robot->led ? 1 : 0;
    }
    if (!one.heading || t < 3) continue;
    const double error = kilotwin::wrapped(one.heading->heading_rad - robot->heading_rad);
    errors.heading += error * error;
    ++errors.headings;
    if (robot->mode != 1 || t - robot->since_s < 2) continue;
    errors.straight += error * error;
    ++errors.straights;
  }
}

Errors errors_of(const Film& film) {
  Errors errors;
  errors.doubts = static_cast<int>(
      play(film, [&](double t, const std::vector<Driver>& robots, const std::vector<TrackedRobot>& seen) {
        errors.tracks = std::max(errors.tracks, seen.size());
        judge(seen, robots, t, errors);
      }));
  return errors;
}

class Rendered : public testing::TestWithParam<Film> {};

TEST_P(Rendered, PosesAndColoursAreRight) {
  const Film& film = GetParam();
  const Errors errors = errors_of(film);
  const auto robots = static_cast<std::size_t>(film.robots);
  EXPECT_EQ(errors.tracks, robots);
  EXPECT_EQ(errors.unmatched, 0);
  EXPECT_EQ(errors.doubts, 0);
  EXPECT_GT(errors.positions, 0.99 * 270 * film.robots);
  const double position_mm = std::sqrt(errors.position / errors.positions);
  const double heading_deg = 180 / kPi * std::sqrt(errors.heading / std::max(1, errors.headings));
  const double straight_deg = 180 / kPi * std::sqrt(errors.straight / std::max(1, errors.straights));
  EXPECT_LT(position_mm, 1);
  EXPECT_LT(heading_deg, 10);
  EXPECT_LT(straight_deg, 5);
  EXPECT_GT(errors.led_right, 0.99 * errors.led_all);
  std::printf(
      "%d robots at %.1f px/mm: position %.3f mm, heading %.2f deg, after 2 s straight %.2f deg, LED %.2f %%\n",
      film.robots, film.px_per_mm, position_mm, heading_deg, straight_deg,
      100.0 * errors.led_right / std::max(1, errors.led_all));
}

INSTANTIATE_TEST_SUITE_P(Films, Rendered, testing::Values(Film{12, 0.6, 3, 0.2, 0.7}, Film{20, 1, 4, 0.25, 0.8}));

}  // namespace
}  // namespace kilotwin::track
