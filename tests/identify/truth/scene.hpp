/// A scene: the truth behind one set of test data. Independent of the project's simulator and identification: its
/// effects are plain functions, with shapes that no effect record can represent exactly.
/// Lengths mm, times s, angles rad; world frame: x right, y up, headings anticlockwise from x.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace kilotwin::truth {

struct Vec {
  double x = 0, y = 0;
};

enum class Motion { kStop, kStraight, kLeft, kRight };

/// Valid from time_s until the next order.
struct Order {
  double time_s;
  Motion motion;
};

/// A value per wheel.
template <typename T> struct Wheels { T left{}, right{}; };

/// Inputs of effects: one robot at one instant.
struct Situation {
  double time_s = 0;
  int run = 0;
  int robot = 0;
  Vec disc;  // disc centre
  double heading_rad = 0;
  Motion motion = Motion::kStop;
  Motion before = Motion::kStop;  // previous motion; kStop for the first
  double since_change_s = 0;
  Wheels<double> driven_s;                  // motor-on time of each wheel in this run; robots rest before it
  double since_rest_s = 0;                  // time since the last rest of both motors
  double trodden_s = 0;                     // driven time of all robots on this spot of the floor in this run
  const std::vector<Vec>* discs = nullptr;  // of all robots, this one included
  double since_other_s = 1e9;               // since another driven robot was on this spot of the floor in this run
  Motion last_turn = Motion::kStop;         // latest turn before the present motion; kStop: none
  double before_s = 0;                      // duration of the previous motion
  int commands = 0;                         // number of motions commanded in this run, the present one included
  const std::vector<Motion>* motions = nullptr;  // of all robots
  bool driven() const { return motion != Motion::kStop; }
};

/// The action of effects on a robot. All effects write into the same object.
struct Push {
  Wheels<double> gain{1, 1};  // factors of f (v + b)
  Wheels<double> offset_mm_s;
  Vec drift_mm_s;  // world frame
  Vec slip_mm_s;   // x ahead, y to the left
  double turn_rad_s = 0;
};

/// The noise-free measurement.
struct View {
  Vec point;
  double heading_rad = 0;
};

using Covariates = std::vector<std::string>;  // names as in result.json

struct Effect {
  std::string name;
  std::string formula;  // description for truth.json
  /// An effect found names this one if its covariates contain all of one of these sets.
  std::vector<Covariates> named_by;
  /// Covariates of look-alikes: an effect found must not have them.
  Covariates mistaken_for;
  std::function<void(const Situation&, Push&)> push;  // either may be empty
  std::function<void(const Situation&, View&)> see;
  /// Factor of the standard deviation of f; may be empty.
  std::function<double(const Situation&)> noise = {};
  /// Chance events, which no predictor can know: the oracle does without them. If nothing names them, no finding has to.
  bool by_chance = false;
  /// True values of numbers that the result gives by these names (Effect.numbers in idl/identification.proto): centres, instants.
  std::map<std::string, double> numbers = {};
};

/// A fault of the data.
struct Fault {
  enum class Kind { kSwapped, kClock, kDuplicate, kOutliers, kFrozen };
  Kind kind;
  int run = 0;
  int robot = 0;
  int other = 0;       // kSwapped: the partner; kDuplicate: number of the copy
  double from_s = 0;   // kSwapped, kFrozen
  double until_s = 0;  // kFrozen
  double amount = 0;   // kClock: stamped over true time; kOutliers: share of positions
};

struct Scene {
  std::string name;
  std::string about;  // one sentence
  int robots = 16;
  int train_runs = 3, test_runs = 2;
  double train_s = 200, test_s = 120;

  // Arena: walls at +-width/2, +-height/2 for disc centres; 0: none. Robots start on a grid in the middle.
  double width_mm = 900, height_mm = 900;
  double start_pitch_mm = 90;
  bool contacts = true;

  // Drive.
  double straight_mm_s = 10, turn_mm_s = 20;  // speed of each wheel straight ahead, and of the outer one in a turn
  double wheel_base_mm = 25;
  double disc_ahead_mm = 9.2;     // disc centre ahead of the point between the wheels
  double tracked_ahead_mm = 9.2;  // tracked point ahead of it
  double bias_mean_mm_s = 0.015, bias_sd_mm_s = 1.2;
  double factor_sd = 0.12;  // of f in a step
  double step_s = 0.1;

  // Spots of the floor: their side, and one corner.
  double spot_mm = 37;
  Vec spot_corner;

  // Orders: a random walk of motion segments, uniform in these ranges; left and right equally frequent.
  double straight_low_s = 3, straight_high_s = 12, turn_low_s = 0.5, turn_high_s = 5, stop_low_s = 1,
         stop_high_s = 6;
  double stop_share = 0.15;  // share of motion changes that lead to a stop
  double left_share = 0.5;

  // Tracker.
  double sample_s = 0.5;
  double jitter = 0;      // of the sampling interval, uniform; 0: regular
  double missing = 0.03;  // share of frames that lack a robot
  double gap_share = 0;   // share of (robot, run) with a gap of 10 s
  double tracker_sd_mm = 0.4;
  bool heading = true;
  double heading_sd_rad = 0.04;
  double coarse = 0;           // share of positions with kCoarse times the noise
  double commands_late_s = 0;  // by which commands are stamped late

  std::vector<Effect> effects;
  std::vector<Fault> faults;  // in training runs
};

constexpr double kCoarse = 8;

/// Standard deviation of f in a step of `dt`.
inline double factor_sd(const Scene& scene, const Situation& at, double dt) {
  double sd = scene.factor_sd * std::sqrt(scene.step_s / dt);
  for (const Effect& effect : scene.effects)
    if (effect.noise) sd *= effect.noise(at);
  return sd;
}

/// Individual parameters of robots, fixed per scene and seed.
struct Individual {
  Wheels<double> bias_mm_s;
};

/// One tracked position.
struct Sample {
  int run, robot;
  double time_s;
  Vec point;
  double heading_rad;
};

/// The true course of one run.
struct Run {
  int number = 0;
  double duration_s = 0;
  std::vector<std::vector<Order>> orders;  // by robot
  std::vector<Sample> samples;             // by robot, then time
  /// Noise-free measurements at 0, 5, 10... s, by robot.
  std::vector<std::vector<View>> marks;
};
constexpr double kMarkInterval_s = 5;

/// A scene simulated with one seed.
struct Play {
  std::uint64_t seed = 0;
  std::vector<Individual> individuals;
  std::vector<Run> train, test;
};

}  // namespace kilotwin::truth
