#include "clients/behaviours/robot_senses.hpp"

#include <algorithm>

#include "core/random/random.hpp"

namespace kilotwin::behaviours {
namespace {

/// How long the reception of a message takes: 13 octets of 10 bits of 269 cycles (kilolib).
constexpr std::uint64_t kPacketCycles = 13 * 10 * 269;

/// Readings where the experiment says nothing: light in the middle of the range, and a charged battery, above 682, the
/// firmware's threshold for full.
constexpr double kLightReading = 512, kVoltageReading = 700;
/// Makes rand_hard() random, and readings of an even battery differ by one count now and then.
constexpr double kVoltageSd = 0.5;

/// The processor's own sensor, counts: 242 mV at -45, 314 mV at 25, 380 mV at 85 degrees Celsius (data sheet of the
/// ATmega328P), of 1.1 V in 1024 steps.
double temperature_reading(double celsius) {
  const double mV = 314 + (celsius - 25) * (celsius < 25 ? 72.0 / 70 : 66.0 / 60);
  return mV * (1024 / 1100.0);
}

}  // namespace

RobotSenses::RobotSenses(const RunPlan& plan, Share share) : share_(share) {
  const proto::Experiment& experiment = plan.experiment();
  if (experiment.has_light()) light_.emplace(plan, share);

  const proto::Temperature& temperature = experiment.temperature();
  temperature_.assign(share.size(), temperature_reading(temperature.celsius()));
  if (experiment.has_temperature()) {
    temperature_sd_ = temperature.reading_sd();
    const Random random(plan.seed());
    for (std::uint32_t i = 0; i < share.size(); ++i) {
      const double offset = random.normal(Stream::kTemperature, share.first + i, Tick{0}, 0);
      temperature_[i] = temperature_reading(temperature.celsius() + temperature.offset_sd() * offset);
    }
  }

  if (!experiment.has_battery()) return;
  battery_.emplace(plan);
  charge_.resize(share.size());
  drain_.resize(share.size());
  supply_.resize(share.size());
  for (std::uint32_t i = 0; i < share.size(); ++i) charge_[i] = battery_->initial(share.first + i);
}

void RobotSenses::at(Tick tick, std::span<const BodyFrame* const> bodies) {
  if (light_) light_->at(tick, bodies);
  if (!battery_) return;
  for (const BodyFrame* frame : bodies) {
    for (std::size_t n = 0; n < frame->robot.size(); ++n) {
      if (share_.contains(frame->robot[n]))
        supply_[frame->robot[n] - share_.first] = battery_->supply(frame->x_mm[n], frame->y_mm[n]);
    }
  }
}

void RobotSenses::surround(std::uint32_t i, std::uint32_t receptions, KtSurroundings& around) const {
  around.light = light_ ? light_->reading(share_.first + i) : kLightReading;
  around.light_sd = light_ ? light_->sd(around.light) : 0;
  around.voltage = battery_ ? battery_->reading(charge_[i], drain_[i]) : kVoltageReading;
  around.voltage_sd = battery_ ? battery_->sd() : kVoltageSd;
  around.temperature = temperature_[i];
  around.temperature_sd = temperature_sd_;
  around.receiving_cycles = receptions * kPacketCycles;
  around.receiving_from = 0;
  around.charging = battery_ && supply_[i] > 0 && charge_[i] < battery_->capacity() ? 1 : 0;
}

void RobotSenses::restore(std::uint32_t i, std::int64_t charge, std::int64_t drain) {
  charge_[i] = charge;
  drain_[i] = drain;
}

void RobotSenses::settle(std::uint32_t i, std::int64_t drain) {
  drain_[i] = drain;
  charge_[i] = std::clamp<std::int64_t>(charge_[i] - drain + supply_[i], 0, battery_->capacity());
}

}  // namespace kilotwin::behaviours
