/// The robots' program on the floor: a random walk with wall avoidance. behaviours/kilogrid.c is the same program
/// for experiments.
///
/// The walk drives straight for |N(15, 1.5)| s and turns for |N(0.5, 3)| s to a random side, both truncated to
/// whole seconds. Cells at the boundary send a message every half second. A robot that receives one turns to a
/// random side until four successive readings are weaker than the four before, and then drives straight. After 1 s
/// without a message the avoidance ends. The robot then keeps its motors until the walk's next transition.
#pragma once

#include <array>
#include <cstdint>

namespace kilotwin::kilogrid {

/// Random numbers for analyses: splitmix64, the same on any machine.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  double uniform();  ///< in (0, 1)
  double normal();

 private:
  std::uint64_t state_;
};

struct WalkTimes {
  double straight_mean_s = 15, straight_sd_s = 1.5, turn_mean_s = 0.5, turn_sd_s = 3;
};

/// Numbered as commands: 1 straight, 2 left, 3 right.
enum class Motion : std::uint8_t { kStop = 0, kStraight = 1, kLeft = 2, kRight = 3 };

class FloorProgram {
 public:
  /// Kilo_ticks per program second, in the walk and in the avoidance.
  static constexpr std::int64_t kWalkTicks = 31, kWallTicks = 32;

  FloorProgram(const WalkTimes& times, std::uint64_t seed) : times_(times), dice_(seed) {}

  /// A message of a boundary cell; `strength` falls with the distance.
  void hear_wall(std::int64_t kilo_ticks, double strength);
  /// One call of loop(). Returns the motion that follows.
  Motion loop(std::int64_t kilo_ticks);
  [[nodiscard]] bool avoiding() const { return avoiding_; }
  /// Continues with another random sequence.
  void reseed(std::uint64_t seed) { dice_ = Dice(seed); }

 private:
  enum class Walk : std::uint8_t { kBegin, kStraight, kTurn };
  enum class Avoid : std::uint8_t { kBegin, kTurn, kEscape };
  static constexpr int kReadings = 4;  // messages that one reading sums up; more make it less noisy, and later

  void walk(std::int64_t now);
  void avoid(std::int64_t now);
  void forget_readings();
  /// |N(mean, sd)| truncated to whole seconds, in kilo_ticks.
  std::int64_t draw(double mean_s, double sd_s);

  WalkTimes times_;
  Dice dice_;
  Walk walk_ = Walk::kBegin;
  Avoid avoid_ = Avoid::kBegin;
  Motion motion_ = Motion::kStop;
  bool avoiding_ = false, wall_near_ = false, new_reading_ = false;
  std::int64_t walk_until_ = 0, wall_until_ = 0, turn_until_ = 0;
  int readings_ = 0;
  double sum_ = 0, reading_ = 0, previous_ = 0;
};

}  // namespace kilotwin::kilogrid
