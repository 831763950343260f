#include "services/comm/tick_timers.hpp"

#include <algorithm>

#include "core/plan/radio_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin::comm {

TickTimers::TickTimers(const RunPlan& plan) {
  const std::uint32_t robots = plan.robots();
  next_.reserve(robots);
  period_.reserve(robots);
  clock_.assign(robots, 0);
  compare_.assign(robots, kRegular);
  count_.assign(robots, 0);
  const Random random(plan.seed());
  const double spread = plan.radio_settings().oscillator_sd;
  std::vector<double> error(robots);
  for (std::uint32_t i = 0; i < robots; ++i) error[i] = spread * random.normal(Stream::kOscillator, i, Tick{0}, 0);
  for (const RobotRadioSettings& known : plan.radio_settings().propagation.robots) {
    if (known.robot < robots && known.oscillator) error[known.robot] += *known.oscillator;
  }
  for (std::uint32_t i = 0; i < robots; ++i) {
    const double rate = 1 + error[i];
    const double period = static_cast<double>(kTimerCounts * kTimerCount) / rate;
    period_.push_back(static_cast<std::uint32_t>(period + 0.5));
    if (plan.radio_settings().model == RadioSettings::Model::kPropagation)
      clock_[i] = static_cast<std::uint16_t>(65536 * random.uniform(Stream::kOscillator, i, Tick{0}, 2));
    next_.push_back(static_cast<Cycles>(period * random.uniform(Stream::kOscillator, i, Tick{0}, 1)));
  }
  shortest_period_ = robots == 0 ? 0 : *std::min_element(period_.begin(), period_.end());
}

}  // namespace kilotwin::comm
