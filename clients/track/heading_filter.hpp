/// A robot's heading from the path of its disc's centre: an interacting multiple model filter over what a Kilobot can do.
///
/// The centre of the disc lies a = 9.2 mm ahead of the middle between the rear legs. When the robot turns about a leg, the centre
/// moves sideways too: its direction of motion is some 36 degrees off the heading. Per mode (stop, straight, left, right) an
/// extended Kalman filter holds (x, y, heading, speed, turn rate) with
///   x' = v cos h - a w sin h,  y' = v sin h + a w cos h,  h' = w.
/// A robot that a wall or another robot holds slides: its path then tells nothing of its heading. A fifth mode, held, has
/// (x, y, heading, x', y') instead, with a heading that wanders. In a sixth one, turned, the disc stays and the robot turns about its
/// centre: only a measured heading shows that.
/// The modes differ in what their speeds are at their beginning, and exchange weight as in Blom and Bar-Shalom (1988).
/// docs/explanation/camera-tracker.md has the equations.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace kilotwin::track {

struct Heading {
  double heading_rad = 0;  ///< anticlockwise from x, in [-pi, pi)
  double variance_rad2 = 0;
};

class HeadingFilter {
 public:
  /// Takes a measured centre. Times ascend. Where `bearing_rad` (a measured heading, from the LED) is given, it has the standard
  /// deviation `bearing_sd_rad`.
  void update(double time_s, double x_mm, double y_mm, double sd_mm,
              std::optional<double> bearing_rad = std::nullopt, double bearing_sd_rad = 0);
  /// Nothing until the robot has moved, or its heading was measured.
  [[nodiscard]] std::optional<Heading> heading() const;
  /// Stop, straight, left, right, held, turned.
  static constexpr std::size_t kModes = 6, kStop = 0, kHeld = 4, kTurned = 5;
  /// Probabilities of the modes; nothing before heading().
  [[nodiscard]] const std::array<double, kModes>& modes() const { return weights_; }

 private:
  using Vector = Eigen::Matrix<double, 5, 1>;
  using Matrix = Eigen::Matrix<double, 5, 5>;
  struct Hypothesis {
    Vector state = Vector::Zero();  ///< x, y, heading, speed, turn rate; of held: x, y, heading, velocity
    Matrix covariance = Matrix::Zero();
  };

  void start(double time_s, double x_mm, double y_mm, double sd_mm, std::optional<double> bearing_rad,
             double bearing_sd_rad);
  void mix(double dt_s, bool heading_is_seen);
  void predict(double dt_s);
  static void predict_held(Hypothesis& h, double dt_s);
  static void predict_turned(Hypothesis& h, double dt_s);
  static void correct(Hypothesis& h, const Vector& change, bool turns);
  void measure(double x_mm, double y_mm, double sd_mm);
  void measure_bearing(double bearing_rad, double sd_rad);
  void weigh(const std::array<double, kModes>& log_likelihoods);

  bool started_ = false;
  double started_s_ = 0, time_s_ = 0;
  std::array<Hypothesis, kModes> hypotheses_;
  std::array<double, kModes> weights_{};
  /// Where the robot was while its heading is not known.
  std::optional<std::array<double, 3>> origin_;  ///< time_s, x_mm, y_mm
};

}  // namespace kilotwin::track
