#include "core/plan/memory_layout.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/plan/effect_settings.hpp"

namespace kilotwin {

using Kind = MemorySlot::Kind;
bool EffectSettings::is_per_wheel() const {
  if (target != Target::kWheelGain && target != Target::kWheelOffset) return false;
  return std::any_of(functions.begin(), functions.end(), [](const FunctionSettings& f) {
    const auto own = [](Covariate c) { return c == Covariate::kDuty || c == Covariate::kMotorTime; };
    return f.noise() != nullptr || own(f.of) || own(f.and_of);
  });
}

MemoryLayout::MemoryLayout(const std::vector<EffectSettings>& effects,
                           const std::vector<ArenaFieldSettings>& fields) {
  const auto need_for = [&](Covariate covariate, double forget_s) {
    switch (covariate) {
      case Covariate::kTimeSinceCommand:
        need({Kind::kCommand});
        need({Kind::kTimeSinceCommand});
        break;
      case Covariate::kMotorTime:
        need({Kind::kLeftMotorTime, forget_s});
        need({Kind::kRightMotorTime, forget_s});
        break;
      case Covariate::kLeftMotorTime: need({Kind::kLeftMotorTime, forget_s}); break;
      case Covariate::kRightMotorTime: need({Kind::kRightMotorTime, forget_s}); break;
      case Covariate::kDrivenTime: need({Kind::kDrivenTime, forget_s}); break;
      case Covariate::kSinceRest: need({Kind::kSinceRest}); break;
      case Covariate::kMotorTimeDifference:
      case Covariate::kMotorTimeSum:
        need({Kind::kLeftMotorTime});
        need({Kind::kRightMotorTime});
        break;
      case Covariate::kPreviousForward: need({Kind::kPreviousForward}); break;
      case Covariate::kPreviousSideways: need({Kind::kPreviousSideways}); break;
      case Covariate::kPreviousTurn: need({Kind::kPreviousTurn}); break;
      case Covariate::kPreviousCommand:
        need({Kind::kCommand});
        need({Kind::kPreviousCommand});
        break;
      case Covariate::kLastTurn: need({Kind::kLastTurn}); break;
      case Covariate::kEarlierTurn:
        need({Kind::kCommand});
        need({Kind::kEarlierTurn});
        break;
      case Covariate::kCommandCount:
        need({Kind::kCommand});
        need({Kind::kCommandCount});
        break;
      case Covariate::kPreviousLasted:
        need({Kind::kCommand});
        need({Kind::kTimeSinceCommand});
        need({Kind::kPreviousLasted});
        break;
      default: break;
    }
  };
  for (std::uint32_t e = 0; e < effects.size(); ++e) {
    const EffectSettings& effect = effects[e];
    for (std::uint32_t f = 0; f < effect.functions.size(); ++f) {
      const FunctionSettings& function = effect.functions[f];
      need_for(function.of, function.forget_s);
      need_for(function.and_of, function.forget_s);
      if (function.episodes() != nullptr) need({Kind::kEpisode, 0, e, f});
      if (function.noise() == nullptr || !(function.noise()->correlation_s > 0)) continue;
      need({Kind::kNoise, 0, e, f, 0});
      if (effect.is_per_wheel() && effect.wheel == EffectSettings::Wheel::kBoth) need({Kind::kNoise, 0, e, f, 1});
    }
  }
  for (std::uint32_t i = 0; i < fields.size(); ++i) {
    if (fields[i].counts == ArenaFieldSettings::Counts::kVisits) need({Kind::kFieldCell, 0, i});
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
