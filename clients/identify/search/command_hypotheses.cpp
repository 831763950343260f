#include "clients/identify/search/covariate_hypotheses.hpp"

#include <algorithm>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

// Sizes of the curves below are columns by which a test notices an effect: refinement adds the others. More columns
// cost power and time; fewer miss curves with a late or a sharp rise.

/// Duration of the previous command: after any command, or when driving straight (long turns persist).
void add_duration_hypotheses(DictionaryBuilder& make, const Extent& extent, std::uint8_t straight_only) {
  constexpr Eigen::Index kCurve = 3;  // one rise or fall over the duration, and its bend
  Factor lasted = over(Shape::kCosines, Covariate::kPreviousLasted, 0, extent.since_s, kCurve);
  lasted.warp = 1;
  for (const std::uint8_t during : {kDriven, straight_only}) {
    const auto bases = make.put(kSpeed, Basis{{lasted}}, during);
    for (const Eigen::Index size : {Eigen::Index{1}, kCurve})
      make.add(kSpeed, "previous-lasted", {"history"}, some(bases, 0, size), 4);
  }
  if (!extent.has_turns) return;
  const Factor which = keyed(Shape::kTable, Covariate::kPreviousCommand, {2, 3});
  lasted.count = 2;
  const auto turned = make.put(kTurning, Basis{{which, lasted}}, straight_only);
  make.add(kTurning, "previous-lasted", {"history"}, some(turned, 0, 4), 2);
}

/// A start that depends on the duration of the previous command, as after a long rest: after a rest, or after any command.
void add_start_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  constexpr std::uint32_t kOverDuration = 3, kOverTime = 4;  // with their constants: twelve columns together
  Factor lasted = over(Shape::kCosines, Covariate::kPreviousLasted, 0, extent.since_s, kOverDuration);
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, kOverTime);
  for (Factor* const f : {&lasted, &since}) {
    f->first = 0;
    f->warp = 1;
  }
  const Basis any{{lasted, since}}, rested{{keyed(Shape::kTable, Covariate::kPreviousCommand, {0}), lasted, since}};
  for (const Basis* const basis : {&any, &rested}) {
    if (basis == &rested && !extent.has_stop) continue;
    make.add(kSpeed, "previous-lasted", {"history", "time_since_command"},
             some(make.put(kSpeed, *basis), 0, static_cast<Eigen::Index>(basis->size())), 2);
  }
}

/// The play of gears: a turn against the latest one begins otherwise than one that continues it.
void add_reversal_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  if (!extent.has_turns) return;
  constexpr Eigen::Index kCurve = 4;  // a start that fades, with its constant
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, kCurve);
  since.first = 0;
  since.warp = 1;  // s: the scale is fine in the first second, when robots start
  const std::vector<double> turns{2, 3};
  const Basis basis{{keyed(Shape::kTable, Covariate::kCommand, turns),
                     keyed(Shape::kTable, Covariate::kEarlierTurn, turns), since}};
  for (const TargetGroup* group : {&kSpeed, &kTurning}) {
    const auto bases = make.put(*group, basis);
    for (const Eigen::Index size : {Eigen::Index{1}, kCurve}) {
      // Left after right, and right after left.
      std::vector<Eigen::Index> columns = some(bases, kCurve, size);
      for (const Eigen::Index c : some(bases, 2 * kCurve, size)) columns.push_back(c);
      std::vector<std::string> words{"history"};
      if (size > 1) words.emplace_back("time_since_command");
      make.add(*group, "turn-reversal", words, columns, 2);
    }
  }
}

/// The number of commands so far: starts wear a motor.
void add_count_hypotheses(DictionaryBuilder& make, const Extent& extent, const std::vector<double>& moving) {
  Factor count = over(Shape::kCosines, Covariate::kCommandCount, 0, extent.commands, 6);
  make.curve(kSpeed, "command-count", {"history"}, Basis{{count}}, {1, 3, 6}, false);
  if (moving.size() < 2) return;
  count.first = 0;
  count.count = 4;
  const Basis each{{keyed(Shape::kTable, Covariate::kCommand, moving), count}};
  make.add(kSpeed, "command-and-command-count", {"command", "history"},
           some(make.put(kSpeed, each), 0, static_cast<Eigen::Index>(each.size())));
}

/// Numbers of the commands under which robots move.
std::vector<double> moving_commands(const Extent& extent) {
  std::vector<double> moving;
  if (extent.has_straight) moving.push_back(1);
  if (extent.has_turns) moving.insert(moving.end(), {2, 3});
  return moving;
}

}  // namespace

void add_motor_time_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const Basis motor{{over(Shape::kCosines, Covariate::kMotorTime, 0, extent.motor_s, 8)}};
  make.curve(kSpeed, "motor-time", {"motor_time"}, motor, {1, 3, 8}, false);
  // Charge drawn from a common battery.
  const Basis both{{over(Shape::kCosines, Covariate::kMotorTimeSum, 0, extent.sum_s, 8)}};
  make.curve(kSpeed, "motor-time", {"motor_time"}, both, {1, 3, 8}, false);
  const Basis driven{{over(Shape::kCosines, Covariate::kDrivenTime, 0, extent.driven_s, 6)}};
  make.curve(kTurning, "driven-time", {"motor_time"}, driven, {1, 3, 6}, false);
  // Slips and drifts have no constant elsewhere.
  Basis whole = driven;
  whole.factors.front().first = 0;
  whole.factors.front().count = 4;
  for (const TargetGroup* group : {&kSlip, &kWorld})
    make.add(*group, "driven-time", {"motor_time"}, some(make.put(*group, whole), 0, 4));
}

void add_command_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const std::vector<double> moving = moving_commands(extent);
  const Basis which{{keyed(Shape::kTable, Covariate::kCommand, moving)}};
  const auto n = static_cast<Eigen::Index>(moving.size());
  for (const TargetGroup* group : {&kSpeed, &kTurning, &kSlip}) {
    const auto bases = make.put(*group, which);
    for (Eigen::Index i = 0; i < n; ++i)
      make.add(*group, "command", {"command"}, some(bases, i, 1), static_cast<double>(n));
    make.add(*group, "command", {"command"}, some(bases, 0, n));
  }
  for (const Target wheel : {Target::kGainLeft, Target::kGainRight}) {
    const auto base = make.put(wheel, which);
    for (Eigen::Index i = 0; i < n; ++i)
      make.add("speed-by-command", {"command"}, kSpeed.in_words, {base + i}, static_cast<double>(n) * 2);
  }
  // Robots at rest may creep.
  if (extent.has_stop) {
    constexpr std::uint8_t kAtRest = 1;  // bit of the command 0, stop
    const auto ahead = make.put(Target::kAhead, {}, kAtRest), aside = make.put(Target::kSideways, {}, kAtRest),
               turning = make.put(Target::kTurn, {}, kAtRest);
    make.add("creep-by-command", {"command"}, "motion at rest", {ahead}, 2);
    make.add("creep-by-command", {"command"}, "motion at rest", {ahead, aside, turning}, 2);
  }
  // A tracker with latency measures moving robots at earlier positions.
  if (moving.size() > 1) {
    const auto ahead = make.put(Target::kMeasuredAhead, which);
    make.add("camera-by-command", {"measurement", "command"}, kCamera.in_words, some({ahead}, 0, n));
  }
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, 8);
  since.warp = 1;
  const Basis start{{since}};
  make.curve(kSpeed, "time-since-command", {"time_since_command"}, start, {1, 3, 8}, false);
  make.curve(kTurning, "time-since-command", {"time_since_command"}, start, {1, 3, 8}, false);
  make.curve(kSlip, "time-since-command", {"time_since_command"}, start, {3}, false);
  // A drift has no constant elsewhere.
  since.first = 0;
  since.count = 4;
  make.add(kWorld, "time-since-command", {"time_since_command"}, some(make.put(kWorld, Basis{{since}}), 0, 4));
  if (n == 1) return;
  make.add(kWorld, "command", {"command"}, some(make.put(kWorld, which), 0, n));
  since.first = 1;
  since.count = 3;
  const Basis each{{keyed(Shape::kTable, Covariate::kCommand, moving), since}};
  for (const TargetGroup* group : {&kSpeed, &kTurning})
    make.add(*group, "command-and-time-since-command", {"command", "time_since_command"},
             some(make.put(*group, each), 0, 3 * n));
}

void add_history_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  if (!extent.has_turns && !extent.has_stop) return;
  constexpr std::uint8_t kStraightOnly = 1u << 1;  // bit of the command 1, straight
  constexpr Eigen::Index kCurve = 4;               // as after a reversal
  std::vector<double> before{kNoCommand};
  if (extent.has_turns) before.insert(before.begin(), {2, 3});
  const auto turns = static_cast<Eigen::Index>(before.size()) - 1;
  if (extent.has_stop) before.push_back(0);
  const auto keys = static_cast<Eigen::Index>(before.size());
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, kCurve);
  since.first = 0;
  since.warp = 1;
  const Factor which = keyed(Shape::kTable, Covariate::kPreviousCommand, before);
  for (const TargetGroup* group : {&kTurning, &kSpeed, &kSlip}) {
    // Sideways slip: constants only.
    const Eigen::Index curve = group == &kSlip ? 1 : kCurve;
    const Basis basis = curve > 1 ? Basis{{which, since}} : Basis{{which}};
    const auto driven = make.put(*group, basis), straight = make.put(*group, basis, kStraightOnly);
    const auto after = [&](const std::vector<Eigen::Index>& bases, Eigen::Index from, Eigen::Index to) {
      for (const Eigen::Index size :
           curve > 1 ? std::vector<Eigen::Index>{1, curve} : std::vector<Eigen::Index>{1}) {
        std::vector<Eigen::Index> columns;
        for (Eigen::Index key = from; key < to; ++key)
          for (const Eigen::Index c : some(bases, key * curve, size)) columns.push_back(c);
        std::vector<std::string> words{"history"};
        if (size > 1) words.emplace_back("time_since_command");
        make.add(*group, "previous-command", words, columns, 4);
      }
    };
    for (const auto& bases : {driven, straight, std::vector<Eigen::Index>{driven[0], straight[0]}}) {
      if (turns > 0) after(bases, 0, turns);
      if (extent.has_stop) {
        after(bases, keys - 1, keys);
        after(bases, turns, keys);
      }
      after(bases, 0, keys);
    }
  }
  // A drift or a slip that fades after one kind of command, or after any.
  for (const TargetGroup* group : {&kWorld, &kSlip}) {
    const auto fading = make.put(*group, Basis{{which, since}});
    for (Eigen::Index key = 0; key < keys; ++key)
      if (before[static_cast<std::size_t>(key)] != kNoCommand)
        make.add(*group, "previous-command", {"history", "time_since_command"}, some(fading, key * kCurve, kCurve),
                 static_cast<double>(keys));
    make.add(*group, "previous-command", {"history", "time_since_command"}, some(fading, 0, keys * kCurve));
  }
  add_duration_hypotheses(make, extent, kStraightOnly);
  add_start_hypotheses(make, extent);
  add_reversal_hypotheses(make, extent);
  add_count_hypotheses(make, extent, moving_commands(extent));
  if (!extent.has_turns) return;
  const Factor last = keyed(Shape::kTable, Covariate::kLastTurn, {2, 3});
  for (const TargetGroup* group : {&kTurning, &kSpeed, &kSlip}) {
    const auto turned = make.put(*group, Basis{{last}}, kStraightOnly);
    make.add(*group, "last-turn", {"history"}, some(turned, 0, 2));
  }
}

void add_inertia_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const std::vector<double> moving = moving_commands(extent);
  if (moving.size() + (extent.has_stop ? 1 : 0) < 2) return;
  // The rest of the motion under the previous command, and the part that the motion under the present one still lacks.
  // Time constants, s, a factor of three apart: any one between has a close neighbour.
  const Factor since = keyed(Shape::kExponential, Covariate::kSinceCommand, {0.4, 1.2, 3.6});
  std::vector<Eigen::Index> columns;
  for (const Target target : {Target::kAhead, Target::kTurn}) {
    for (const Covariate which : {Covariate::kPreviousCommand, Covariate::kCommand}) {
      const Basis basis{{keyed(Shape::kTable, which, moving), since}};
      const std::uint8_t during = which == Covariate::kCommand ? kDriven : kAlways;
      for (const Eigen::Index c :
           some({make.put(target, basis, during)}, 0, static_cast<Eigen::Index>(basis.size())))
        columns.push_back(c);
    }
  }
  make.add("inertia-by-command", {"history", "time_since_command"}, "speed and turn rate", columns);
}

void add_discounted_motor_time_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const auto lately = [&](Shape shape, Covariate of, std::size_t decay_index, std::uint32_t count) {
    Factor f = over(shape, of, 0, std::min(kDecayTimes_s[decay_index], extent.driven_s), count);
    f.axis.decay_index = static_cast<std::uint8_t>(decay_index + 1);
    return f;
  };
  constexpr auto kChoices = static_cast<double>(kDecayTimes_s.size());
  for (std::size_t f = 0; f < kDecayTimes_s.size(); ++f) {
    for (const Covariate of : {Covariate::kMotorTime, Covariate::kDrivenTime}) {
      const auto bases = make.put(kSpeed, Basis{{lately(Shape::kCosines, of, f, 3)}});
      for (const Eigen::Index size : {1, 3})
        make.add(kSpeed, of == Covariate::kMotorTime ? "discounted-motor-time" : "discounted-driven-time",
                 {"motor_time", "history"}, some(bases, 0, size), kChoices);
    }
    if (!extent.has_turns) continue;
    const auto left = make.put(Target::kTurn, Basis{{lately(Shape::kLinear, Covariate::kLeftMotorTime, f, 1)}}),
               right = make.put(Target::kTurn, Basis{{lately(Shape::kLinear, Covariate::kRightMotorTime, f, 1)}});
    make.add(kTurning, "discounted-turns", {"history"}, {left, right}, kChoices);
  }
  // Time since the last rest: a battery that sags and recovers at once.
  if (extent.has_stop) {
    Factor unbroken = over(Shape::kCosines, Covariate::kSinceRest, 0, extent.since_rest_s, 6);
    unbroken.warp = 1;
    for (const TargetGroup* group : {&kSpeed, &kTurning})
      make.curve(*group, "time-since-rest", {"motor_time", "history"}, Basis{{unbroken}}, {1, 3, 6}, false);
  }
  if (!extent.has_turns) return;
  const Basis wound{
      {over(Shape::kCosines, Covariate::kMotorTimeDifference, -extent.difference_s, extent.difference_s, 6)}};
  make.curve(kTurning, "turns-so-far", {"motor_time", "history"}, wound, {1, 3, 6}, false);
  // Accumulated turns: a cable winds up.
  const auto left = make.put(Target::kTurn,
                             Basis{{over(Shape::kLinear, Covariate::kLeftMotorTime, 0, extent.motor_s, 1)}}),
             right = make.put(Target::kTurn,
                              Basis{{over(Shape::kLinear, Covariate::kRightMotorTime, 0, extent.motor_s, 1)}});
  make.add(kTurning, "turns-so-far", {"history", "motor_time"}, {left, right}, kChoices);
}

}  // namespace kilotwin::identify
