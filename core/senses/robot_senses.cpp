#include "core/senses/robot_senses.hpp"

#include <algorithm>

#include "core/plan/senses_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin::senses {
namespace {

/// Reading of the processor's temperature sensor, counts. The converter's reference has 1.1 volts. The data sheet of the ATmega328P gives
/// 242 mV at -45, 314 mV at 25 and 380 mV at 85 degrees Celsius.
double temperature_reading(double celsius) {
  const double mV = 314 + (celsius - 25) * (celsius < 25 ? 72.0 / 70 : 66.0 / 60);
  return mV * (1024 / 1100.0);
}

}  // namespace

RobotSenses::RobotSenses(const RunPlan& plan, Share share) : share_(share) {
  if (plan.light_settings()) light_.emplace(plan, share);

  temperature_.assign(share.size(), Readings{}.temperature);
  if (const std::optional<TemperatureSettings>& temperature = plan.temperature_settings()) {
    temperature_sd_ = temperature->reading_sd;
    const Random random(plan.seed());
    for (std::uint32_t i = 0; i < share.size(); ++i) {
      const double offset = random.normal(Stream::kTemperature, share.first + i, Tick{0}, 0);
      temperature_[i] = temperature_reading(temperature->celsius + temperature->offset_sd * offset);
    }
  }

  if (!plan.battery_settings()) return;
  battery_.emplace(plan);
  charge_.resize(share.size());
  drain_.resize(share.size());
  supply_.resize(share.size());
  for (std::uint32_t i = 0; i < share.size(); ++i) charge_[i] = battery_->initial(share.first + i);
}

void RobotSenses::at(const SwarmView& swarm) {
  if (light_) light_->at(swarm);
  if (!battery_) return;
  for (std::uint32_t i = 0; i < share_.size(); ++i)
    supply_[i] = battery_->supply(swarm.x_mm[share_.first + i], swarm.y_mm[share_.first + i]);
}

void RobotSenses::restore(std::uint32_t i, std::int64_t charge, std::int64_t drain) {
  charge_[i] = charge;
  drain_[i] = drain;
}

void RobotSenses::settle(std::uint32_t i, std::int64_t drain) {
  drain_[i] = drain;
  charge_[i] = std::clamp<std::int64_t>(charge_[i] - drain + supply_[i], 0, battery_->capacity());
}

}  // namespace kilotwin::senses
