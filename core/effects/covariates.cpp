#include "core/effects/covariates.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/effects/motion_change.hpp"
#include "core/math/elementary.h"

namespace kilotwin {

using Kind = MemorySlot::Kind;

namespace {

/// The memory slot that stores a covariate, if any.
std::optional<MemorySlot> slot_of(Covariate covariate, double forget_s) {
  switch (covariate) {
    case Covariate::kTimeSinceCommand: return MemorySlot{Kind::kTimeSinceCommand};
    case Covariate::kLeftMotorTime: return MemorySlot{Kind::kLeftMotorTime, forget_s};
    case Covariate::kRightMotorTime: return MemorySlot{Kind::kRightMotorTime, forget_s};
    case Covariate::kDrivenTime: return MemorySlot{Kind::kDrivenTime, forget_s};
    case Covariate::kPreviousForward: return MemorySlot{Kind::kPreviousForward};
    case Covariate::kPreviousSideways: return MemorySlot{Kind::kPreviousSideways};
    case Covariate::kPreviousTurn: return MemorySlot{Kind::kPreviousTurn};
    case Covariate::kPreviousCommand: return MemorySlot{Kind::kPreviousCommand};
    case Covariate::kLastTurn: return MemorySlot{Kind::kLastTurn};
    case Covariate::kPreviousLasted: return MemorySlot{Kind::kPreviousLasted};
    case Covariate::kSinceRest: return MemorySlot{Kind::kSinceRest};
    case Covariate::kEarlierTurn: return MemorySlot{Kind::kEarlierTurn};
    case Covariate::kCommandCount: return MemorySlot{Kind::kCommandCount};
    default: return std::nullopt;
  }
}

/// Whether the covariate is a sum over neighbours.
bool is_sum(Covariate covariate) { return covariate == Covariate::kNeighbours || covariate == Covariate::kDensity; }

/// Weight of a neighbour in a direction whose angle from the focus has this cosine: ((1 + cosine) / 2)^focus.
double focus_weight(double cosine, std::uint32_t focus) {
  const double once = (1 + cosine) / 2;
  double share = 1;
  for (std::uint32_t i = 0; i < focus; ++i) share *= once;
  return share;
}

}  // namespace

Covariate of_wheel(Covariate covariate, std::uint32_t wheel) {
  if (covariate == Covariate::kDuty) return wheel == 0 ? Covariate::kRightDuty : Covariate::kLeftDuty;
  if (covariate == Covariate::kMotorTime)
    return wheel == 0 ? Covariate::kRightMotorTime : Covariate::kLeftMotorTime;
  return covariate;
}

Covariates::Covariates(const RunPlan& plan) : plan_(plan) {}

std::uint32_t Covariates::need(Covariate covariate, const FunctionSettings& function) {
  Column column;
  column.covariate = covariate;
  if (covariate == Covariate::kPointDistance) column.point = function.point;
  if (covariate == Covariate::kAlong) kt_sincos(function.along_deg * (kPi / 180), &column.along_y, &column.along_x);
  if (is_of_neighbours(covariate)) {
    column.radius_mm = function.radius_mm;
    column.others = function.others;
    column.other_robots = function.other_robots;
    if (is_sum(covariate) && function.focus > 0) {
      column.focus = function.focus;
      column.toward_rad = function.toward_deg * (kPi / 180);
    }
    if (column.radius_mm > radius_mm_) {
      radius_mm_ = column.radius_mm;
      cells_.emplace(radius_mm_);
    }
  }
  if (covariate == Covariate::kPlace) {
    const std::vector<ArenaFieldSettings>& fields = plan_.fields();
    while (column.field < fields.size() && fields[column.field].name != function.field) ++column.field;
    KILOTWIN_DEMAND(column.field < fields.size());
  }
  if (covariate >= Covariate::kLeftMotorTime && covariate <= Covariate::kDrivenTime)
    column.forget_s = function.forget_s;
  if (const auto slot = slot_of(covariate, column.forget_s)) column.slot = plan_.memory.index_of(*slot);
  for (std::uint32_t i = 0; i < columns_.size(); ++i) {
    const Column& known = columns_[i];
    if (known.covariate == covariate && known.radius_mm == column.radius_mm && known.forget_s == column.forget_s &&
        known.focus == column.focus && known.toward_rad == column.toward_rad && known.field == column.field &&
        known.others == column.others && known.other_robots == column.other_robots && known.point == column.point &&
        known.along_x == column.along_x && known.along_y == column.along_y) {
      return i;
    }
  }
  columns_.push_back(std::move(column));
  return static_cast<std::uint32_t>(columns_.size() - 1);
}

Range Covariates::range(std::uint32_t index) const {
  const Column& column = columns_[index];
  const double x_mm = plan_.world.arena.stated_width_mm() / 2, y_mm = plan_.world.arena.stated_height_mm() / 2;
  const double duration_s = plan_.duration_s;
  const double most_neighbours =
      (column.radius_mm / kRobotRadius_mm + 1) * (column.radius_mm / kRobotRadius_mm + 1);
  constexpr double kFast_mm_s = 200, kFast_rad_s = 20;  // beyond the limits of models
  switch (column.covariate) {
    case Covariate::kTime:
    case Covariate::kTimeSinceCommand:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime:
    case Covariate::kPreviousLasted:
    case Covariate::kSinceRest: return {0, duration_s};
    case Covariate::kMotorTimeDifference: return {-duration_s, duration_s};
    case Covariate::kMotorTimeSum: return {0, 2 * duration_s};
    case Covariate::kX: return {-x_mm, x_mm};
    case Covariate::kY: return {-y_mm, y_mm};
    case Covariate::kRadius: return {0, __builtin_sqrt(x_mm * x_mm + y_mm * y_mm)};
    case Covariate::kPointDistance: {
      const MovingPointSettings& p = column.point;
      const double away_x_mm = x_mm + magnitude(p.x_mm) + magnitude(p.velocity_x_mm_s) * duration_s,
                   away_y_mm = y_mm + magnitude(p.y_mm) + magnitude(p.velocity_y_mm_s) * duration_s,
                   growth_mm = p.growth_mm_s * duration_s;
      return {-std::max(growth_mm, 0.0),
              __builtin_sqrt(away_x_mm * away_x_mm + away_y_mm * away_y_mm) - std::min(growth_mm, 0.0)};
    }
    case Covariate::kAlong: {
      const double most_mm = x_mm * magnitude(column.along_x) + y_mm * magnitude(column.along_y);
      return {-most_mm, most_mm};
    }
    case Covariate::kHeading:
    case Covariate::kNearestBearing: return {-kPi, kPi};
    case Covariate::kCommand:
    case Covariate::kPreviousCommand:
    case Covariate::kLastTurn:
    case Covariate::kEarlierTurn: return {0, 3};
    // The command changes at most once a tick.
    case Covariate::kCommandCount: return {0, duration_s / plan_.tick_length.seconds() + 1};
    case Covariate::kLeftDuty:
    case Covariate::kRightDuty: return {0, 255};
    case Covariate::kNeighbours:
    case Covariate::kDensity: return {0, std::min(most_neighbours, static_cast<double>(plan_.robots()))};
    case Covariate::kNearest: return {0, column.radius_mm};
    case Covariate::kRobot: return {0, static_cast<double>(plan_.robots())};
    case Covariate::kRun: return {static_cast<double>(plan_.run_number()), static_cast<double>(plan_.run_number())};
    case Covariate::kPlace:
      if (plan_.fields()[column.field].counts == ArenaFieldSettings::Counts::kTrail) return {0, 1};
      return {0, duration_s * plan_.robots() / plan_.tick_length.seconds()};
    case Covariate::kPreviousForward:
    case Covariate::kPreviousSideways: return {-kFast_mm_s, kFast_mm_s};
    case Covariate::kPreviousTurn: return {-kFast_rad_s, kFast_rad_s};
    case Covariate::kNothing:
    case Covariate::kDuty:
    case Covariate::kMotorTime: break;
  }
  return {0, 0};
}

void Covariates::fill(Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who,
                      const ArenaFields* fields) {
  command_bits_.resize(who.size());
  for (std::size_t i = 0; i < who.size(); ++i) command_bits_[i] = bit_of(command_of(robots.duties[who[i]]));
  for (Column& column : columns_) {
    column.values.resize(who.size());
    fill(column, now, robots, who, fields);
  }
  if (radius_mm_ > 0) fill_neighbours(robots, who);
}

// NOLINTNEXTLINE(readability-function-size): a switch over many cases
void Covariates::fill(Column& column, Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who,
                      const ArenaFields* fields) const {
  double* const to = column.values.data();
  const std::size_t count = who.size(), stride = plan_.memory.size();
  const auto each = [&](auto&& value) {
    for (std::size_t i = 0; i < count; ++i) to[i] = value(std::size_t{who[i]});
  };
  const auto remembered = [&] { each([&](std::size_t r) { return robots.memory[r * stride + column.slot]; }); };
  // The remembered value, unless the command changes at this tick.
  const auto unless_changed = [&](auto&& otherwise) {
    const std::uint32_t command = plan_.memory.index_of({Kind::kCommand});
    each([&](std::size_t r) {
      const double* const memory = robots.memory.data() + r * stride;
      return memory[command] == static_cast<double>(command_of(robots.duties[r])) ? memory[column.slot]
                                                                                  : otherwise(memory, command);
    });
  };
  switch (column.covariate) {
    case Covariate::kTime:
      return each([time_s = plan_.tick_length.seconds_at(now)](std::size_t) { return time_s; });
    case Covariate::kX: return each([&](std::size_t r) { return robots.x_mm[r]; });
    case Covariate::kY: return each([&](std::size_t r) { return robots.y_mm[r]; });
    case Covariate::kRadius:
      return each([&](std::size_t r) {
        return __builtin_sqrt(robots.x_mm[r] * robots.x_mm[r] + robots.y_mm[r] * robots.y_mm[r]);
      });
    case Covariate::kPointDistance: {
      const MovingPointSettings& p = column.point;
      const double time_s = plan_.tick_length.seconds_at(now), centre_x_mm = p.x_mm + p.velocity_x_mm_s * time_s,
                   centre_y_mm = p.y_mm + p.velocity_y_mm_s * time_s;
      return each([&](std::size_t r) {
        const double dx = robots.x_mm[r] - centre_x_mm, dy = robots.y_mm[r] - centre_y_mm;
        return __builtin_sqrt(dx * dx + dy * dy) - p.growth_mm_s * time_s;
      });
    }
    case Covariate::kAlong:
      return each([&](std::size_t r) { return column.along_x * robots.x_mm[r] + column.along_y * robots.y_mm[r]; });
    case Covariate::kHeading: return each([&](std::size_t r) { return robots.heading_rad[r]; });
    case Covariate::kCommand:
      return each([&](std::size_t r) { return static_cast<double>(command_of(robots.duties[r])); });
    case Covariate::kLeftDuty: return each([&](std::size_t r) { return double{1} * robots.duties[r].left; });
    case Covariate::kRightDuty: return each([&](std::size_t r) { return double{1} * robots.duties[r].right; });
    case Covariate::kTimeSinceCommand: return unless_changed([](const double*, std::uint32_t) { return 0.0; });
    case Covariate::kPreviousCommand:
      return unless_changed([](const double* memory, std::uint32_t command) { return memory[command]; });
    case Covariate::kEarlierTurn:
      return unless_changed([slot = column.slot](const double* memory, std::uint32_t command) {
        return is_turn(static_cast<MotionCommand>(memory[command])) ? memory[command] : memory[slot];
      });
    case Covariate::kCommandCount:
      return unless_changed([slot = column.slot](const double* memory, std::uint32_t) { return memory[slot] + 1; });
    case Covariate::kPreviousLasted: {
      const std::uint32_t time = plan_.memory.index_of({Kind::kTimeSinceCommand});
      return unless_changed([time](const double* memory, std::uint32_t) { return memory[time]; });
    }
    case Covariate::kSinceRest:
      return each(
          [&](std::size_t r) { return robots.duties[r].any() ? robots.memory[r * stride + column.slot] : 0.0; });
    case Covariate::kMotorTimeDifference: {
      const std::uint32_t left = plan_.memory.index_of({Kind::kLeftMotorTime}),
                          right = plan_.memory.index_of({Kind::kRightMotorTime});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[left] - memory[right];
      });
    }
    case Covariate::kMotorTimeSum: {
      const std::uint32_t left = plan_.memory.index_of({Kind::kLeftMotorTime}),
                          right = plan_.memory.index_of({Kind::kRightMotorTime});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[left] + memory[right];
      });
    }
    case Covariate::kLastTurn:
      return each([&](std::size_t r) {
        const MotionCommand command = command_of(robots.duties[r]);
        return is_turn(command) ? static_cast<double>(command) : robots.memory[r * stride + column.slot];
      });
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime:
    case Covariate::kPreviousForward:
    case Covariate::kPreviousSideways:
    case Covariate::kPreviousTurn: return remembered();
    case Covariate::kRobot: return each([&](std::size_t r) { return static_cast<double>(robots.robot[r]); });
    case Covariate::kRun: return each([run = static_cast<double>(plan_.run_number())](std::size_t) { return run; });
    case Covariate::kPlace:
      KILOTWIN_DEMAND(fields != nullptr);
      return each([&](std::size_t r) {
        return fields->value(column.field, robots.robot[r], robots.x_mm[r], robots.y_mm[r], now);
      });
    case Covariate::kNeighbours:
    case Covariate::kNearest:
    case Covariate::kDensity:
    case Covariate::kNearestBearing:  // set by fill_neighbours
    case Covariate::kNothing:
    case Covariate::kDuty:
    case Covariate::kMotorTime: return;
  }
}

bool Covariates::counts(const Column& column, const RobotColumns& robots, std::uint32_t other) {
  if (column.others != Others::kAny && robots.duties[other].any() != (column.others == Others::kDriven))
    return false;
  return column.other_robots.empty() ||
         std::binary_search(column.other_robots.begin(), column.other_robots.end(), robots.robot[other]);
}

void Covariates::fill_neighbours(const RobotColumns& robots, std::span<const std::uint32_t> who) {
  cells_->build(robots.x_mm, robots.y_mm);
  for (std::size_t i = 0; i < who.size(); ++i) {
    const std::uint32_t self = who[i];
    const double x = robots.x_mm[self], y = robots.y_mm[self];
    const std::size_t count = cells_->find(x, y, self, found_);
    for (Column& column : columns_) {
      if (!is_of_neighbours(column.covariate)) continue;
      const double radius_square_mm2 = column.radius_mm * column.radius_mm;
      double nearest_square_mm2 = radius_square_mm2, neighbours = 0, density = 0, toward_x = 0, toward_y = 0;
      std::uint32_t nearest = self;
      if (column.focus > 0) kt_sincos(robots.heading_rad[self] + column.toward_rad, &toward_y, &toward_x);
      for (std::size_t k = 0; k < count; ++k) {
        const double dx = robots.x_mm[found_[k]] - x, dy = robots.y_mm[found_[k]] - y, square = dx * dx + dy * dy;
        if (square > radius_square_mm2 || !counts(column, robots, found_[k])) continue;
        double share = 1;
        // A neighbour at the same position has no direction; its cosine counts as 0.
        if (column.focus > 0) {
          const double d = __builtin_sqrt(square);
          share = focus_weight(d > 0 ? (dx * toward_x + dy * toward_y) / d : 0, column.focus);
        }
        neighbours += share;
        const double weight = 1 - square / radius_square_mm2;
        density += share * (weight * weight);
        // Of several equally near neighbours, the first counts.
        if (square < nearest_square_mm2 || nearest == self) {
          nearest_square_mm2 = square;
          nearest = found_[k];
        }
      }
      double value = 0;
      switch (column.covariate) {
        case Covariate::kNeighbours: value = neighbours; break;
        case Covariate::kDensity: value = density; break;
        case Covariate::kNearest: value = __builtin_sqrt(nearest_square_mm2); break;
        default:
          if (nearest != self) {
            value =
                wrapped(kt_atan2(robots.y_mm[nearest] - y, robots.x_mm[nearest] - x) - robots.heading_rad[self]);
          }
      }
      column.values[i] = value;
    }
  }
}

}  // namespace kilotwin
