/// Rendered films of robots that drive by the kinematics of docs/explanation/motion.md under random commands, and their truth: for
/// the tests of the tracker and its measurements.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "clients/track/tracker.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::track {

/// A robot, by the middle between its rear legs.
struct Driver {
  double x_mm, y_mm, heading_rad;
  double bias_left, bias_right;  ///< of the wheels, mm/s
  int mode = 1;                  ///< stop, straight, left, right
  double until_s = 0, since_s = 0;
  std::uint8_t led = 0;  ///< r | g << 2 | b << 4
  double led_since_s = 0;

  [[nodiscard]] Pose pose() const;
};

/// Brightness of the LEDs.
enum class FilmLeds { kFull, kLevels, kOff };

struct Film {
  int robots = 12;
  double px_per_mm = 1, noise = 3, uneven = 0.2, blur_px = 0.7;
  double duration_s = 9;
  FilmLeds leds = FilmLeds::kFull;
  double pitch_mm = 120;  ///< of the grid in which robots start
  bool moves = true;
  double gain = 1;  ///< of the camera: brightness
  std::uint64_t seed = 9;
  /// Variance per second of the factor by which each wheel's speed fluctuates, as factor_variance_s of a model.
  double factor_variance_s = 0;
  /// From then on something holds the robots: their discs stay, and their motors turn them.
  double held_from_s = 1e9;
  /// By which the light of a picture is multiplied, by its time; absent: 1.
  std::function<double(double t_s)> light{};
};

/// Per frame: its time, the truth, what the tracker says.
using Judge = std::function<void(double, const std::vector<Driver>&, const std::vector<TrackedRobot>&)>;

/// Plays the film to a tracker that knows the scale. Returns how often tracks came into doubt.
std::uint64_t play(const Film& film, const Judge& judge);

/// The robot of the truth that is nearest, and its distance; nothing beyond 8 mm.
[[nodiscard]] const Driver* robot_at(const std::vector<Driver>& robots, const FloorPoint& at, double* off_mm);

}  // namespace kilotwin::track
