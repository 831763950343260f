/// The program that the robots of the floor run, as far as it moves them: a random walk, and turning away from walls.
/// behaviours/kilogrid.c is the same for robots of an experiment.
///
/// The walk goes straight for |N(15, 1.5)| s and turns for |N(0.5, 3)| s to either side, both cut to whole seconds. Cells on
/// the floor's rim send a message every half second; a robot that receives one turns to either side until four
/// readings in a row are weaker than the four before, then goes straight; 1 s without a message ends it. It then does
/// what the walk would have done meanwhile, and until the walk's next step keeps its motors as they are.
#pragma once

#include <array>
#include <cstdint>

namespace kilotwin::kilogrid {

/// Random numbers for what is not part of a run's own result: splitmix64, the same on any machine.
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

/// As commands of the contract: 1 straight, 2 left, 3 right.
enum class Motion : std::uint8_t { kStop = 0, kStraight = 1, kLeft = 2, kRight = 3 };

class FloorProgram {
 public:
  /// Kilo_ticks that the program takes for a second, for times of the walk and of the avoidance.
  static constexpr std::int64_t kWalkTicks = 31, kWallTicks = 32;

  FloorProgram(const WalkTimes& times, std::uint64_t seed) : times_(times), dice_(seed) {}

  /// A cell of the rim was received; the stronger, the nearer.
  void hear_wall(std::int64_t kilo_ticks, double strength);
  /// One call of the loop. Returns what the motors do then.
  Motion loop(std::int64_t kilo_ticks);
  [[nodiscard]] bool avoiding() const { return avoiding_; }

 private:
  enum class Walk : std::uint8_t { kBegin, kStraight, kTurn };
  enum class Avoid : std::uint8_t { kBegin, kTurn, kEscape };
  static constexpr int kReadings = 4;

  void walk(std::int64_t now);
  void avoid(std::int64_t now);
  void forget_readings();
  /// Whole seconds of |N(mean, sd)|, in kilo_ticks.
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
