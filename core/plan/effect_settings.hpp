/// Settings of effects and arena fields. idl/effects.proto gives meaning, units and defaults. Enumerators have the numbers of its
/// enumerations.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace kilotwin {

enum class MotionCommand : std::uint8_t { kStop, kStraight, kTurnLeft, kTurnRight };

enum class Covariate : std::uint8_t {
  kNothing,
  kTime,
  kX,
  kY,
  kRadius,
  kHeading,
  kCommand,
  kDuty,
  kLeftDuty,
  kRightDuty,
  kTimeSinceCommand,
  kMotorTime,
  kLeftMotorTime,
  kRightMotorTime,
  kDrivenTime,
  kNeighbours,
  kNearest,
  kDensity,
  kNearestBearing,
  kRobot,
  kRun,
  kPlace,
  kPreviousForward,
  kPreviousSideways,
  kPreviousTurn,
  kPreviousCommand,
  kLastTurn,
  kPreviousLasted,
  kSinceRest,
  kMotorTimeDifference,
  kEarlierTurn,
  kCommandCount,
  kMotorTimeSum,
  kPointDistance,
  kAlong
};

/// The centre of circles that move and grow. A circle of constant kPointDistance c has the radius c + growth_mm_s t.
struct MovingPointSettings {
  double x_mm = 0, y_mm = 0;  ///< at the start of the run
  double velocity_x_mm_s = 0, velocity_y_mm_s = 0, growth_mm_s = 0;

  bool operator==(const MovingPointSettings&) const = default;
};

/// Other robots that count as neighbours, by what they do in the coming tick.
enum class Others : std::uint8_t { kAny, kDriven, kResting };

struct ConstantShape {
  double value = 0;
};
struct LinearShape {
  double at_zero = 0, slope = 0;
};
struct ExponentialShape {
  double at_zero = 0, at_infinity = 0, scale = 1;
};
struct HarmonicShape {
  double mean = 0, cosine = 0, sine = 0, period = 1;
};
struct SplineShape {
  std::vector<double> knots, values;
};
struct Spline2dShape {
  std::vector<double> first_knots, second_knots;
  std::vector<double> values;  ///< per pair of knots; the index of the first variable runs fastest
};
struct StepsShape {
  std::vector<double> at, values;
};
struct TableShape {
  std::vector<std::uint32_t> keys;
  std::vector<double> values;
  double otherwise = 0;
};
struct NoiseShape {
  double sd = 0, correlation_s = 0;
};
struct EpisodesShape {
  double mean_apart_s = 0, scale_s = 0, tail = 0, longest_s = 0, shape = 1;
};

struct FunctionSettings {
  Covariate of = Covariate::kNothing, and_of = Covariate::kNothing;
  double radius_mm = 0;
  std::string field;  ///< name of an arena field, with kPlace
  double forget_s = 0;
  std::uint32_t focus = 0;
  double toward_deg = 0;
  double along_deg = 0;  ///< with kAlong
  Others others = Others::kAny;
  std::vector<std::uint32_t>
      other_robots;           ///< numbers of the only robots that count as neighbours, ascending; empty: all
  MovingPointSettings point;  ///< with kPointDistance
  std::variant<ConstantShape, LinearShape, ExponentialShape, HarmonicShape, SplineShape, Spline2dShape, StepsShape,
               TableShape, NoiseShape, EpisodesShape>
      shape;

  /// The shape if it is of this kind, else null.
  [[nodiscard]] const NoiseShape* noise() const { return std::get_if<NoiseShape>(&shape); }
  [[nodiscard]] const EpisodesShape* episodes() const { return std::get_if<EpisodesShape>(&shape); }
};

struct EffectSettings {
  enum class Target : std::uint8_t {
    kWheelGain,
    kWheelOffset,
    kTurnRate,
    kBodyDrift,
    kWorldDrift,
    kMeasuredOffset,
    kMeasuredBodyOffset,
    kMeasuredScale,
    kMeasuredHeading
  };
  enum class Wheel : std::uint8_t { kBoth, kLeftWheel, kRightWheel };

  Target target = Target::kWheelGain;
  Wheel wheel = Wheel::kBoth;
  double direction_deg = 0;
  std::vector<FunctionSettings> functions;
  std::vector<MotionCommand> during;
  std::vector<std::uint32_t> robots;
  std::string
      sum;  ///< with kWheelGain: gains of one name are added before they act; empty: the gain acts by itself

  /// Whether the effect belongs to the measurement model, not to the motion model.
  [[nodiscard]] bool is_measured() const { return target >= Target::kMeasuredOffset; }
  /// Whether the effect is computed for each wheel separately, because its noise or covariate differs between the wheels.
  [[nodiscard]] bool is_per_wheel() const;
};

struct ArenaFieldSettings {
  enum class Counts : std::uint8_t { kDrivenTime, kPresentTime, kVisits, kTrail };
  std::string name;
  Counts counts = Counts::kDrivenTime;
  double cell_mm = 0, forget_s = 0;
  std::optional<double> corner_x_mm = {}, corner_y_mm = {};
};

}  // namespace kilotwin
