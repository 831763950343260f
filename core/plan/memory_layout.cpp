#include "core/plan/memory_layout.hpp"

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin {

using Kind = MemorySlot::Kind;
using proto::Effect, proto::Function;

bool is_measured(Effect::Target target) { return target >= Effect::MEASURED_OFFSET; }

bool is_per_wheel(const Effect& effect) {
  if (effect.acts_on() != Effect::WHEEL_GAIN && effect.acts_on() != Effect::WHEEL_OFFSET) return false;
  return std::any_of(effect.function().begin(), effect.function().end(), [](const Function& f) {
    const auto own = [](Function::Covariate c) { return c == Function::DUTY || c == Function::MOTOR_TIME; };
    return f.has_noise() || own(f.of()) || own(f.and_of());
  });
}

MemoryLayout::MemoryLayout(const proto::Experiment& experiment) {
  const auto need_for = [&](Function::Covariate covariate, double forget_s) {
    switch (covariate) {
      case Function::TIME_SINCE_COMMAND:
        need({Kind::kCommand});
        need({Kind::kTimeSinceCommand});
        break;
      case Function::MOTOR_TIME:
        need({Kind::kLeftMotorTime, forget_s});
        need({Kind::kRightMotorTime, forget_s});
        break;
      case Function::LEFT_MOTOR_TIME: need({Kind::kLeftMotorTime, forget_s}); break;
      case Function::RIGHT_MOTOR_TIME: need({Kind::kRightMotorTime, forget_s}); break;
      case Function::DRIVEN_TIME: need({Kind::kDrivenTime, forget_s}); break;
      case Function::SINCE_REST: need({Kind::kSinceRest}); break;
      case Function::MOTOR_TIME_DIFFERENCE:
        need({Kind::kLeftMotorTime});
        need({Kind::kRightMotorTime});
        break;
      case Function::PREVIOUS_FORWARD: need({Kind::kPreviousForward}); break;
      case Function::PREVIOUS_SIDEWAYS: need({Kind::kPreviousSideways}); break;
      case Function::PREVIOUS_TURN: need({Kind::kPreviousTurn}); break;
      case Function::PREVIOUS_COMMAND:
        need({Kind::kCommand});
        need({Kind::kPreviousCommand});
        break;
      case Function::LAST_TURN: need({Kind::kLastTurn}); break;
      case Function::PREVIOUS_LASTED:
        need({Kind::kCommand});
        need({Kind::kTimeSinceCommand});
        need({Kind::kPreviousLasted});
        break;
      default: break;
    }
  };
  for (int e = 0; e < experiment.effect_size(); ++e) {
    const Effect& effect = experiment.effect(e);
    for (int f = 0; f < effect.function_size(); ++f) {
      const Function& function = effect.function(f);
      need_for(function.of(), function.forget_s());
      need_for(function.and_of(), function.forget_s());
      if (function.has_episodes())
        need({Kind::kEpisode, 0, static_cast<std::uint32_t>(e), static_cast<std::uint32_t>(f)});
      if (!function.has_noise() || !(function.noise().correlation_s() > 0)) continue;
      const auto index = static_cast<std::uint32_t>(e), number = static_cast<std::uint32_t>(f);
      need({Kind::kNoise, 0, index, number, 0});
      if (is_per_wheel(effect) && effect.wheel() == Effect::BOTH_WHEELS) need({Kind::kNoise, 0, index, number, 1});
    }
  }
  for (int i = 0; i < experiment.field_size(); ++i) {
    if (experiment.field(i).counts() == proto::ArenaField::VISITS)
      need({Kind::kFieldCell, 0, static_cast<std::uint32_t>(i)});
  }
}

void MemoryLayout::need(const MemorySlot& slot) {
  if (std::find(slots_.begin(), slots_.end(), slot) == slots_.end()) slots_.push_back(slot);
}

std::uint32_t MemoryLayout::index_of(const MemorySlot& slot) const {
  const auto found = std::find(slots_.begin(), slots_.end(), slot);
  KILOTWIN_DEMAND(found != slots_.end());
  return static_cast<std::uint32_t>(found - slots_.begin());
}

}  // namespace kilotwin
