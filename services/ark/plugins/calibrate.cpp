/// Calibration of straight motion, as the real station does it for a whole swarm at once: each robot drives with its own duties,
/// the station fits its path, and corrects the two duties until the path is straight.
///
/// Messages to single robots: 1 left, 2 right, 3 stop, 4 the duty of the left motor for straight motion, 5 that of the right
/// motor, upon which the robot drives; the data is the duty. The broadcast 111 lets all robots store their duties. The robots'
/// program: behaviours/housekeeping.c. Turning duties are left as they are.
///
/// Curvature of a path: x(t) and y(t) are fitted by quadratic functions; k = (vx ay - vy ax) / v^3 at the middle. A robot of
/// wheel distance B whose wheels differ by dv has k = dv / (B v). The left motor drives the right-hand wheel. So the left
/// duty falls and the right duty rises by half of k B v / s each, with s the speed per duty. Between rounds all robots turn by
/// about half a turn, so that they stay near their places.
///
/// Parameters: rounds (5), drive_s (8), duty (70), turn_duty (70), half_turn_s (3.9), wheel_distance_mm (25), mm_s_per_duty
/// (0.142857). Report: mean absolute curvature, 1/m, before and after, with its standard error over robots.
#include <kilotwin_station.hpp>

namespace {

constexpr std::uint8_t kLeft = 1, kStop = 3, kStraightLeft = 4, kStraightRight = 5, kStore = 111;
constexpr double kStart_s = 1, kShortest_s = 1.1, kMessagesPerSecond = 60;
constexpr double kLeastSpeed_mm = 2;  ///< a slower robot is held by something, and says nothing of its motors

/// Least squares of x and y by a + b t + c t^2, with times from -1 to 1.
class Path {
 public:
  void clear() { sums_.fill(0); }
  void add(double t, Point place) {
    double power = 1;
    for (std::size_t i = 0; i < 5; ++i, power *= t) sums_[i] += power;
    for (std::size_t i = 0; i < 3; ++i) {
      const double weight = i == 0 ? 1 : i == 1 ? t : t * t;
      sums_[5 + i] += weight * place.x();
      sums_[8 + i] += weight * place.y();
    }
  }
  struct Motion {
    double speed_mm_s = 0, curvature_per_mm = 0;
  };
  /// `half_s`: what a time of 1 stands for.
  [[nodiscard]] Motion motion(double half_s) const {
    const std::array<double, 2> x = fit(5), y = fit(8);
    const double vx = x[0] / half_s, vy = y[0] / half_s, ax = 2 * x[1] / (half_s * half_s),
                 ay = 2 * y[1] / (half_s * half_s);
    const double speed = __builtin_sqrt(vx * vx + vy * vy);
    if (speed < kLeastSpeed_mm) return {speed, 0};
    return {speed, (vx * ay - vy * ax) / (speed * speed * speed)};
  }
  void serialize(Archive& archive) { archive& sums_; }

 private:
  /// b and c by Cramer's rule.
  [[nodiscard]] std::array<double, 2> fit(std::size_t at) const {
    const double n = sums_[0], s1 = sums_[1], s2 = sums_[2], s3 = sums_[3], s4 = sums_[4];
    const double r0 = sums_[at], r1 = sums_[at + 1], r2 = sums_[at + 2];
    const double whole = n * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2);
    if (n < 5 || whole == 0) return {0, 0};
    const double b = n * (r1 * s4 - r2 * s3) - r0 * (s1 * s4 - s2 * s3) + s2 * (s1 * r2 - s2 * r1);
    const double c = n * (s2 * r2 - s3 * r1) - s1 * (s1 * r2 - s2 * r1) + r0 * (s1 * s3 - s2 * s2);
    return {b / whole, c / whole};
  }
  /// Of t^0..t^4; of x, x t, x t^2; the same of y.
  std::array<double, 11> sums_{};
};

struct Motors {
  double left = 0, right = 0;  ///< duties for straight motion
  Path path;
  double first_per_mm = 0, last_per_mm = 0;
  std::uint8_t moved = 0;  ///< 1: in the first run; 3: and in the last
  void serialize(Archive& archive) { archive& left& right& path& first_per_mm& last_per_mm& moved; }
};

class Calibration : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    rounds_ = static_cast<std::uint32_t>(parameter("rounds", 5));
    drive_s_ = parameter("drive_s", 8);
    const double duty = parameter("duty", 70);
    turn_duty_ = parameter("turn_duty", 70);
    half_turn_s_ = parameter("half_turn_s", 3.9);
    wheel_distance_mm_ = parameter("wheel_distance_mm", 25);
    mm_s_per_duty_ = parameter("mm_s_per_duty", 1.0 / 7);
    wait_s_ = kShortest_s + robots() / kMessagesPerSecond;
    motors_.resize(robots());
    for (Motors& motors : motors_) motors.left = motors.right = duty;
  }
  void run() override {
    if (phase_ == Phase::kBegin) {
      if (time >= kStart_s) enter(Phase::kLeftDuty);
      return;
    }
    updateKilobotStates();
    if (time - entered_at_s_ < length_s()) return;
    switch (phase_) {
      case Phase::kLeftDuty: return enter(Phase::kRightDuty);
      case Phase::kRightDuty:
        for (Motors& motors : motors_) motors.path.clear();
        return enter(Phase::kDriving);
      case Phase::kDriving: evaluate(); return enter(Phase::kStopping);
      case Phase::kStopping:
        if (round_ > rounds_) return finish();
        return enter(Phase::kTurning);
      case Phase::kTurning: return enter(Phase::kHalting);
      case Phase::kHalting: return enter(Phase::kLeftDuty);
      default: return;
    }
  }
  void updateKilobotState(Kilobot kilobot) override {
    if (phase_ != Phase::kDriving || !kilobot.isSeen()) return;
    motors_[kilobot.getID()].path.add(2 * (time - entered_at_s_) / drive_s_ - 1, kilobot.getPosition());
  }
  void serialize(Archive& archive) override { archive& phase_& entered_at_s_& round_& motors_; }
  [[nodiscard]] std::uint64_t word() override {
    return std::uint64_t{round_} << 8 | static_cast<std::uint8_t>(phase_);
  }
  [[nodiscard]] std::string logState(Kilobot kilobot) override {
    const Motors& motors = motors_[kilobot.getID()];
    return std::to_string(duty_of(motors.left)) + '\t' + std::to_string(duty_of(motors.right)) + '\t' +
           std::to_string(motors.last_per_mm);
  }

 private:
  enum class Phase : std::uint8_t { kBegin, kLeftDuty, kRightDuty, kDriving, kStopping, kTurning, kHalting, kDone };

  static unsigned duty_of(double duty) {
    const double whole = kt_floor(duty + 0.5);
    return whole < 1 ? 1 : whole > 255 ? 255 : static_cast<unsigned>(whole);
  }
  [[nodiscard]] double length_s() const {
    if (phase_ == Phase::kDriving) return drive_s_;
    if (phase_ == Phase::kTurning) return half_turn_s_ > wait_s_ ? half_turn_s_ : wait_s_;
    return wait_s_;
  }
  void enter(Phase phase) {
    phase_ = phase;
    entered_at_s_ = time;
    for (std::uint32_t robot = 0; robot < robots(); ++robot) {
      switch (phase) {
        case Phase::kLeftDuty:
          signalKilobot(make_message(robot, kStraightLeft, duty_of(motors_[robot].left)));
          break;
        case Phase::kRightDuty:
          signalKilobot(make_message(robot, kStraightRight, duty_of(motors_[robot].right)));
          break;
        case Phase::kTurning: signalKilobot(make_message(robot, kLeft, duty_of(turn_duty_))); break;
        case Phase::kStopping:
        case Phase::kHalting: signalKilobot(make_message(robot, kStop, 0)); break;
        default: break;
      }
    }
  }
  void evaluate() {
    ++round_;
    for (Motors& motors : motors_) {
      const Path::Motion motion = motors.path.motion(drive_s_ / 2);
      const bool moved = motion.speed_mm_s >= kLeastSpeed_mm;
      if (round_ == 1) {
        motors.first_per_mm = motion.curvature_per_mm;
        motors.moved = moved ? 1 : 0;
      }
      if (round_ > rounds_) {  // the last run only measures
        motors.last_per_mm = motion.curvature_per_mm;
        if (moved) motors.moved = static_cast<std::uint8_t>(motors.moved | 2);
        continue;
      }
      if (!moved) continue;
      const double change = motion.curvature_per_mm * wheel_distance_mm_ * motion.speed_mm_s / mm_s_per_duty_;
      const double half = change / 2 > 20 ? 20 : change / 2 < -20 ? -20 : change / 2;
      motors.left -= half;
      motors.right += half;
    }
  }
  struct Mean {
    double mean = 0, error = 0;
  };
  /// Of absolute curvatures, 1/m, over the robots that drove in both runs.
  [[nodiscard]] Mean mean_of(double Motors::*curvature) const {
    double sum = 0, squares = 0, n = 0;
    for (const Motors& motors : motors_) {
      if (motors.moved != 3) continue;
      const double value = 1000 * (motors.*curvature < 0 ? -(motors.*curvature) : motors.*curvature);
      sum += value;
      squares += value * value;
      n += 1;
    }
    if (n < 2) return {n > 0 ? sum : 0, 0};
    const double mean = sum / n, variance = (squares - n * mean * mean) / (n - 1);
    return {mean, __builtin_sqrt((variance > 0 ? variance : 0) / n)};
  }
  void finish() {
    phase_ = Phase::kDone;
    broadcastMessage({kStore, {}});
    const Mean before = mean_of(&Motors::first_per_mm), after = mean_of(&Motors::last_per_mm);
    std::uint32_t driven = 0;
    std::string duties;
    for (const Motors& motors : motors_) {
      driven += motors.moved == 3 ? 1u : 0u;
      duties += (duties.empty() ? "[" : ", [") + std::to_string(duty_of(motors.left)) + ", " +
                std::to_string(duty_of(motors.right)) + "]";
    }
    const auto json = [](const Mean& mean) {
      return "{\"mean_abs_curvature_per_m\": " + std::to_string(mean.mean) +
             ", \"standard_error\": " + std::to_string(mean.error) + "}";
    };
    report("{\"procedure\": \"calibrate\", \"robots\": " + std::to_string(robots()) +
               ", \"driven\": " + std::to_string(driven) + ", \"rounds\": " + std::to_string(rounds_) +
               ", \"seconds\": " + std::to_string(time) + ", \"before\": " + json(before) +
               ", \"after\": " + json(after) + ", \"duties\": [" + duties + "]}",
           "calibration: mean absolute curvature " + std::to_string(before.mean) + " +- " +
               std::to_string(before.error) + " per m before, " + std::to_string(after.mean) + " +- " +
               std::to_string(after.error) + " after, " + std::to_string(driven) + " of " +
               std::to_string(robots()) + " robots");
    experimentComplete();
  }

  std::uint32_t rounds_ = 0, round_ = 0;
  double drive_s_ = 0, turn_duty_ = 0, half_turn_s_ = 0, wheel_distance_mm_ = 0, mm_s_per_duty_ = 0, wait_s_ = 0;
  Phase phase_ = Phase::kBegin;
  double entered_at_s_ = 0;
  std::vector<Motors> motors_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new Calibration; }
