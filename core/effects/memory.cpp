#include "core/effects/memory.hpp"

#include <algorithm>

#include "core/effects/episodes.hpp"
#include "core/effects/term.hpp"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

std::uint32_t draw_of(const MemorySlot& slot) { return (slot.index * 8 + slot.function) * 2 + slot.wheel; }

/// Time until the next episode; at least a tick, so that no phase is skipped.
double wait_s(const EpisodesShape& e, double uniform, double tick_s) {
  return std::max(episode_wait_s(e, uniform), tick_s);
}
double length_s(const EpisodesShape& e, double uniform, double tick_s) {
  return std::clamp(episode_length_s(e, uniform), tick_s, std::max(e.longest_s, tick_s));
}

}  // namespace

EffectMemory::EffectMemory(const RunPlan& plan)
    : plan_(plan), random_(plan.seed()), tick_s_(plan.tick_length.seconds()), fades_(plan.memory.size()) {
  const std::vector<MemorySlot>& slots = plan.memory.slots();
  for (std::size_t s = 0; s < slots.size(); ++s) {
    const MemorySlot& slot = slots[s];
    notes_motion_ = notes_motion_ || (slot.kind >= Kind::kPreviousForward && slot.kind <= Kind::kPreviousTurn);
    if (slot.kind == Kind::kTimeSinceCommand) time_slot_ = static_cast<std::uint32_t>(s);
    if (slot.kind == Kind::kPreviousCommand) previous_slot_ = static_cast<std::uint32_t>(s);
    if (slot.kind == Kind::kPreviousLasted) lasted_slot_ = static_cast<std::uint32_t>(s);
    if (slot.kind == Kind::kEarlierTurn) earlier_turn_slot_ = static_cast<std::uint32_t>(s);
    if (slot.kind == Kind::kCommandCount) count_slot_ = static_cast<std::uint32_t>(s);
    if (slot.kind == Kind::kNoise) {
      const NoiseShape& noise = *plan.effects()[slot.index].functions[slot.function].noise();
      const double keep = kt_exp(-tick_s_ / noise.correlation_s);
      fades_[s] = {keep, __builtin_sqrt(1 - keep * keep)};
    } else if (slot.forget_s > 0) {
      fades_[s].keep = kt_exp(-tick_s_ / slot.forget_s);
    }
  }
}

void EffectMemory::start(std::uint32_t robot, std::span<double> memory) const {
  const std::vector<MemorySlot>& slots = plan_.memory.slots();
  for (std::size_t s = 0; s < slots.size(); ++s) {
    memory[s] = slots[s].kind == Kind::kFieldCell ? -1
                : slots[s].kind == Kind::kEpisode ? next_episode(slots[s], robot, Tick{0}, -tick_s_)
                : slots[s].kind == Kind::kNoise
                    ? random_.normal(Stream::kCorrelatedNoise, robot, Tick{0}, draw_of(slots[s]))
                    : 0;
  }
}

double EffectMemory::next_episode(const MemorySlot& slot, std::uint32_t robot, Tick now, double left_s) const {
  // A remainder of up to half a tick counts to the current phase.
  if (left_s > tick_s_ * 1.5) return left_s - tick_s_;
  if (left_s < -tick_s_ * 1.5) return left_s + tick_s_;
  const EpisodesShape& episodes = *plan_.effects()[slot.index].functions[slot.function].episodes();
  const double uniform = random_.uniform(Stream::kEpisodes, robot, now, draw_of(slot));
  return left_s > 0 ? -length_s(episodes, uniform, tick_s_) : wait_s(episodes, uniform, tick_s_);
}

void EffectMemory::advance(Tick from, const RobotColumns& robots, std::span<const double> x_mm,
                           std::span<const double> y_mm, std::span<const double> heading_rad,
                           std::span<double> memory) const {
  const std::vector<MemorySlot>& slots = plan_.memory.slots();
  const std::size_t stride = slots.size(), count = robots.size();
  const auto each = [&](std::size_t s, auto&& next) {
    for (std::size_t i = 0; i < count; ++i) {
      if (robots.tracked[i] == 0) memory[i * stride + s] = next(i, memory[i * stride + s]);
    }
  };
  const auto lasts = [&](std::size_t s, auto&& on) {
    each(s, [&, keep = fades_[s].keep](std::size_t i, double was) {
      return was * keep + (on(robots.duties[i]) ? tick_s_ : 0);
    });
  };
  for (std::size_t s = 0; s < stride; ++s) {
    switch (slots[s].kind) {
      case Kind::kCommand:
        // Slots of the previous command must read the memory before this slot changes.
        each(s, [&](std::size_t i, double was) {
          const double command = static_cast<double>(command_of(robots.duties[i]));
          double* const own = memory.data() + i * stride;
          if (lasted_slot_ && was != command) own[*lasted_slot_] = own[*time_slot_];
          if (time_slot_) own[*time_slot_] = (was == command ? own[*time_slot_] : 0) + tick_s_;
          if (previous_slot_ && was != command) own[*previous_slot_] = was;
          if (earlier_turn_slot_ && was != command && is_turn(static_cast<MotionCommand>(was)))
            own[*earlier_turn_slot_] = was;
          if (count_slot_ && was != command) own[*count_slot_] += 1;
          return command;
        });
        break;
      case Kind::kLastTurn:
        each(s, [&](std::size_t i, double was) {
          const MotionCommand command = command_of(robots.duties[i]);
          return is_turn(command) ? static_cast<double>(command) : was;
        });
        break;
      case Kind::kLeftMotorTime: lasts(s, [](Duties d) { return d.left != 0 || d.spin_up != 0; }); break;
      case Kind::kRightMotorTime: lasts(s, [](Duties d) { return d.right != 0 || d.spin_up != 0; }); break;
      case Kind::kDrivenTime: lasts(s, [](Duties d) { return d.any(); }); break;
      case Kind::kSinceRest:
        each(s, [&](std::size_t i, double was) { return robots.duties[i].any() ? was + tick_s_ : 0; });
        break;
      case Kind::kNoise:
        each(s, [&, fade = fades_[s]](std::size_t i, double was) {
          const double next =
              fade.keep * was +
              fade.renew * random_.normal(Stream::kCorrelatedNoise, robots.robot[i], from + 1, draw_of(slots[s]));
          return std::clamp(next, -kTopNormal, kTopNormal);
        });
        break;
      case Kind::kEpisode:
        each(s, [&](std::size_t i, double was) { return next_episode(slots[s], robots.robot[i], from + 1, was); });
        break;
      case Kind::kTimeSinceCommand:  // set with the command
      case Kind::kPreviousCommand:
      case Kind::kPreviousLasted:
      case Kind::kEarlierTurn:
      case Kind::kCommandCount:
      case Kind::kPreviousForward:
      case Kind::kPreviousSideways:
      case Kind::kPreviousTurn:      // set below
      case Kind::kFieldCell: break;  // ArenaFields::count
    }
  }
  if (!notes_motion_) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (robots.tracked[i] != 0) continue;
    double s, c;
    kt_sincos(robots.heading_rad[i], &s, &c);
    const double dx = (x_mm[i] - robots.x_mm[i]) / tick_s_, dy = (y_mm[i] - robots.y_mm[i]) / tick_s_;
    for (std::size_t m = 0; m < stride; ++m) {
      double& value = memory[i * stride + m];
      if (slots[m].kind == Kind::kPreviousForward) value = c * dx + s * dy;
      if (slots[m].kind == Kind::kPreviousSideways) value = c * dy - s * dx;
      if (slots[m].kind == Kind::kPreviousTurn) value = wrapped(heading_rad[i] - robots.heading_rad[i]) / tick_s_;
    }
  }
}

}  // namespace kilotwin
