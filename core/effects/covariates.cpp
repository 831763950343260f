#include "core/effects/covariates.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/math/elementary.h"

namespace kilotwin {

using proto::Function;
using Kind = MemorySlot::Kind;

namespace {

/// The slot of memory that a covariate is read from, if any.
std::optional<MemorySlot> slot_of(Function::Covariate covariate, double forget_s) {
  switch (covariate) {
    case Function::TIME_SINCE_COMMAND: return MemorySlot{Kind::kTimeSinceCommand};
    case Function::LEFT_MOTOR_TIME: return MemorySlot{Kind::kLeftMotorTime, forget_s};
    case Function::RIGHT_MOTOR_TIME: return MemorySlot{Kind::kRightMotorTime, forget_s};
    case Function::DRIVEN_TIME: return MemorySlot{Kind::kDrivenTime, forget_s};
    case Function::PREVIOUS_FORWARD: return MemorySlot{Kind::kPreviousForward};
    case Function::PREVIOUS_SIDEWAYS: return MemorySlot{Kind::kPreviousSideways};
    case Function::PREVIOUS_TURN: return MemorySlot{Kind::kPreviousTurn};
    case Function::PREVIOUS_COMMAND: return MemorySlot{Kind::kPreviousCommand};
    case Function::LAST_TURN: return MemorySlot{Kind::kLastTurn};
    case Function::PREVIOUS_LASTED: return MemorySlot{Kind::kPreviousLasted};
    case Function::SINCE_REST: return MemorySlot{Kind::kSinceRest};
    default: return std::nullopt;
  }
}

/// Whether neighbours are added up.
bool is_sum(Function::Covariate covariate) {
  return covariate == Function::NEIGHBOURS || covariate == Function::DENSITY;
}

/// What of a robot counts whose direction is off by an angle of that cosine.
double focused(double cosine, std::uint32_t focus) {
  const double once = (1 + cosine) / 2;
  double share = 1;
  for (std::uint32_t i = 0; i < focus; ++i) share *= once;
  return share;
}

}  // namespace

Function::Covariate of_wheel(Function::Covariate covariate, std::uint32_t wheel) {
  if (covariate == Function::DUTY) return wheel == 0 ? Function::RIGHT_DUTY : Function::LEFT_DUTY;
  if (covariate == Function::MOTOR_TIME) return wheel == 0 ? Function::RIGHT_MOTOR_TIME : Function::LEFT_MOTOR_TIME;
  return covariate;
}

Covariates::Covariates(const RunPlan& plan) : plan_(plan) {}

std::uint32_t Covariates::need(Covariate covariate, const Function& function) {
  Column column{covariate, 0, 0, 0, 0, 0, 0, {}};
  if (is_of_neighbours(covariate)) {
    column.radius_mm = function.radius_mm();
    if (is_sum(covariate) && function.focus() > 0) {
      column.focus = function.focus();
      column.toward_rad = function.toward_deg() * (kPi / 180);
    }
    if (column.radius_mm > radius_mm_) {
      radius_mm_ = column.radius_mm;
      cells_.emplace(radius_mm_);
    }
  }
  if (covariate == Function::PLACE) {
    const auto& fields = plan_.experiment().field();
    while (column.field < static_cast<std::uint32_t>(fields.size()) &&
           fields[static_cast<int>(column.field)].name() != function.field())
      ++column.field;
    KILOTWIN_DEMAND(column.field < static_cast<std::uint32_t>(fields.size()));
  }
  if (covariate >= Function::LEFT_MOTOR_TIME && covariate <= Function::DRIVEN_TIME)
    column.forget_s = function.forget_s();
  if (const auto slot = slot_of(covariate, column.forget_s)) column.slot = plan_.memory.index_of(*slot);
  for (std::uint32_t i = 0; i < columns_.size(); ++i) {
    const Column& known = columns_[i];
    if (known.covariate == covariate && known.radius_mm == column.radius_mm && known.forget_s == column.forget_s &&
        known.focus == column.focus && known.toward_rad == column.toward_rad && known.field == column.field) {
      return i;
    }
  }
  columns_.push_back(std::move(column));
  return static_cast<std::uint32_t>(columns_.size() - 1);
}

Range Covariates::range(std::uint32_t index) const {
  const Column& column = columns_[index];
  const proto::Experiment& e = plan_.experiment();
  const double x_mm = e.arena().width_mm() / 2, y_mm = e.arena().height_mm() / 2;
  const double most_neighbours =
      (column.radius_mm / kRobotRadius_mm + 1) * (column.radius_mm / kRobotRadius_mm + 1);
  constexpr double kFast_mm_s = 200, kFast_rad_s = 20;  // beyond what the limits of models allow
  switch (column.covariate) {
    case Function::TIME:
    case Function::TIME_SINCE_COMMAND:
    case Function::LEFT_MOTOR_TIME:
    case Function::RIGHT_MOTOR_TIME:
    case Function::DRIVEN_TIME:
    case Function::PREVIOUS_LASTED:
    case Function::SINCE_REST: return {0, e.duration_s()};
    case Function::MOTOR_TIME_DIFFERENCE: return {-e.duration_s(), e.duration_s()};
    case Function::X: return {-x_mm, x_mm};
    case Function::Y: return {-y_mm, y_mm};
    case Function::RADIUS: return {0, __builtin_sqrt(x_mm * x_mm + y_mm * y_mm)};
    case Function::HEADING:
    case Function::NEAREST_BEARING: return {-kPi, kPi};
    case Function::COMMAND:
    case Function::PREVIOUS_COMMAND:
    case Function::LAST_TURN: return {0, 3};
    case Function::LEFT_DUTY:
    case Function::RIGHT_DUTY: return {0, 255};
    case Function::NEIGHBOURS:
    case Function::DENSITY: return {0, std::min(most_neighbours, static_cast<double>(plan_.robots()))};
    case Function::NEAREST: return {0, column.radius_mm};
    case Function::ROBOT: return {0, static_cast<double>(plan_.robots())};
    case Function::RUN: return {static_cast<double>(e.run_number()), static_cast<double>(e.run_number())};
    case Function::PLACE: return {0, e.duration_s() * plan_.robots() / plan_.tick_length.seconds()};
    case Function::PREVIOUS_FORWARD:
    case Function::PREVIOUS_SIDEWAYS: return {-kFast_mm_s, kFast_mm_s};
    case Function::PREVIOUS_TURN: return {-kFast_rad_s, kFast_rad_s};
    case Function::NOTHING:
    case Function::DUTY:
    case Function::MOTOR_TIME: break;
  }
  return {0, 0};
}

void Covariates::fill(Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who,
                      const ArenaFields* fields) {
  command_bits_.resize(who.size());
  for (std::size_t i = 0; i < who.size(); ++i)
    command_bits_[i] = static_cast<std::uint8_t>(1u << command_of(robots.duties[who[i]]));
  for (Column& column : columns_) {
    column.values.resize(who.size());
    fill(column, now, robots, who, fields);
  }
  if (radius_mm_ > 0) fill_neighbours(robots, who);
}

void Covariates::fill(Column& column, Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who,
                      const ArenaFields* fields) const {
  double* const to = column.values.data();
  const std::size_t count = who.size(), stride = plan_.memory.size();
  const auto each = [&](auto&& value) {
    for (std::size_t i = 0; i < count; ++i) to[i] = value(std::size_t{who[i]});
  };
  const auto remembered = [&] { each([&](std::size_t r) { return robots.memory[r * stride + column.slot]; }); };
  switch (column.covariate) {
    case Function::TIME: return each([time_s = plan_.tick_length.seconds_at(now)](std::size_t) { return time_s; });
    case Function::X: return each([&](std::size_t r) { return robots.x_mm[r]; });
    case Function::Y: return each([&](std::size_t r) { return robots.y_mm[r]; });
    case Function::RADIUS:
      return each([&](std::size_t r) {
        return __builtin_sqrt(robots.x_mm[r] * robots.x_mm[r] + robots.y_mm[r] * robots.y_mm[r]);
      });
    case Function::HEADING: return each([&](std::size_t r) { return robots.heading_rad[r]; });
    case Function::COMMAND:
      return each([&](std::size_t r) { return static_cast<double>(command_of(robots.duties[r])); });
    case Function::LEFT_DUTY: return each([&](std::size_t r) { return double{1} * robots.duties[r].left; });
    case Function::RIGHT_DUTY: return each([&](std::size_t r) { return double{1} * robots.duties[r].right; });
    case Function::TIME_SINCE_COMMAND: {
      const std::uint32_t command = plan_.memory.index_of({Kind::kCommand});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[command] == static_cast<double>(command_of(robots.duties[r])) ? memory[column.slot] : 0.0;
      });
    }
    case Function::PREVIOUS_COMMAND: {
      const std::uint32_t command = plan_.memory.index_of({Kind::kCommand});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[command] == static_cast<double>(command_of(robots.duties[r])) ? memory[column.slot]
                                                                                    : memory[command];
      });
    }
    case Function::PREVIOUS_LASTED: {
      const std::uint32_t command = plan_.memory.index_of({Kind::kCommand}),
                          time = plan_.memory.index_of({Kind::kTimeSinceCommand});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[command] == static_cast<double>(command_of(robots.duties[r])) ? memory[column.slot]
                                                                                    : memory[time];
      });
    }
    case Function::SINCE_REST:
      return each(
          [&](std::size_t r) { return robots.duties[r].any() ? robots.memory[r * stride + column.slot] : 0.0; });
    case Function::MOTOR_TIME_DIFFERENCE: {
      const std::uint32_t left = plan_.memory.index_of({Kind::kLeftMotorTime}),
                          right = plan_.memory.index_of({Kind::kRightMotorTime});
      return each([&](std::size_t r) {
        const double* const memory = robots.memory.data() + r * stride;
        return memory[left] - memory[right];
      });
    }
    case Function::LAST_TURN:
      return each([&](std::size_t r) {
        const proto::Command command = command_of(robots.duties[r]);
        return is_turn(command) ? static_cast<double>(command) : robots.memory[r * stride + column.slot];
      });
    case Function::LEFT_MOTOR_TIME:
    case Function::RIGHT_MOTOR_TIME:
    case Function::DRIVEN_TIME:
    case Function::PREVIOUS_FORWARD:
    case Function::PREVIOUS_SIDEWAYS:
    case Function::PREVIOUS_TURN: return remembered();
    case Function::ROBOT: return each([&](std::size_t r) { return static_cast<double>(robots.robot[r]); });
    case Function::RUN:
      return each([run = static_cast<double>(plan_.experiment().run_number())](std::size_t) { return run; });
    case Function::PLACE:
      KILOTWIN_DEMAND(fields != nullptr);
      return each([&](std::size_t r) { return fields->value(column.field, robots.x_mm[r], robots.y_mm[r], now); });
    case Function::NEIGHBOURS:
    case Function::NEAREST:
    case Function::DENSITY:
    case Function::NEAREST_BEARING:  // fill_neighbours
    case Function::NOTHING:
    case Function::DUTY:
    case Function::MOTOR_TIME: return;
  }
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
        if (square > radius_square_mm2) continue;
        double share = 1;
        // Of one that stands at the same place there is no direction.
        if (column.focus > 0) {
          const double d = __builtin_sqrt(square);
          share = focused(d > 0 ? (dx * toward_x + dy * toward_y) / d : 0, column.focus);
        }
        neighbours += share;
        const double weight = 1 - square / radius_square_mm2;
        density += share * (weight * weight);
        // Of several that are equally near, the first.
        if (square < nearest_square_mm2 || nearest == self) {
          nearest_square_mm2 = square;
          nearest = found_[k];
        }
      }
      double value = 0;
      switch (column.covariate) {
        case Function::NEIGHBOURS: value = neighbours; break;
        case Function::DENSITY: value = density; break;
        case Function::NEAREST: value = __builtin_sqrt(nearest_square_mm2); break;
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
