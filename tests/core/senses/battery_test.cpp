#include "core/senses/battery.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.hpp"

namespace kilotwin::senses {
namespace {

using testing::make_plan;

constexpr double kUnitsPer_mAh = 1000 * 3600 * 8e6;

RunPlan plan_of(const std::string& battery, std::uint32_t robots = 1) {
  return make_plan("battery { " + battery + " }", testing::grid_crowd(robots, 40, testing::Facing::kRight));
}

TEST(Battery, DrainsByTheStatedCurrents) {
  const RunPlan plan = plan_of("idle_mA: 5 sleep_mA: 0.5 motor_mA: 20 led_mA: 3 transmission_mA: 40");
  const Battery battery(plan);
  const double hours = 0.032768 / 3600;
  const auto mAh = [&](const Battery::Use& use) { return static_cast<double>(battery.drain(use)) / kUnitsPer_mAh; };
  EXPECT_NEAR(mAh({}), 5 * hours, 1e-15);
  EXPECT_NEAR(mAh({255, 0, 0, false, false}), 25 * hours, 1e-15);
  EXPECT_NEAR(mAh({51, 255, 0, false, false}), (5 + 20 * 0.2 + 20) * hours, 1e-15);
  EXPECT_NEAR(mAh({0, 0, 63, false, false}), (5 + 9) * hours, 1e-15);
  EXPECT_NEAR(mAh({0, 0, 2 | 1 << 4, false, false}), (5 + 3) * hours, 1e-15);
  EXPECT_NEAR(mAh({0, 0, 0, false, true}), 5 * hours + 40 * 0.00437125 / 3600, 1e-15);
  EXPECT_NEAR(mAh({255, 255, 63, true, true}), 0.5 * hours, 1e-15) << "asleep, all else is off";
}

TEST(Battery, LastsAsLongAsSpecified) {
  // The specification: 3 hours with all loads on, a day idle, months asleep.
  const RunPlan plan = plan_of("");
  const Battery battery(plan);
  const auto hours = [&](const Battery::Use& use) {
    return static_cast<double>(battery.capacity()) / static_cast<double>(battery.drain(use)) * 0.032768 / 3600;
  };
  EXPECT_NEAR(hours({255, 255, 63, false, false}), 3, 0.3);
  EXPECT_NEAR(hours({}), 24, 1);
  EXPECT_NEAR(hours({0, 0, 0, true, false}) / 24 / 30, 3, 0.3);
}

TEST(Battery, ReadsTheFirmwaresThresholdsAtRoundVoltages) {
  EXPECT_NEAR(voltage_reading(4.0), 682, 1);
  EXPECT_NEAR(voltage_reading(3.8), 648, 1);
  EXPECT_NEAR(voltage_reading(3.6), 614, 1);
}

TEST(Battery, VoltageFallsWithChargeAndUnderLoad) {
  const RunPlan plan = plan_of("resistance_ohm: 2");
  const Battery battery(plan);
  double before = 1e9;
  for (int percent = 100; percent >= 0; --percent) {
    const double reading = battery.reading(battery.capacity() / 100 * percent, 0);
    EXPECT_LT(reading, before);
    before = reading;
  }
  EXPECT_NEAR(battery.reading(battery.capacity(), 0), voltage_reading(4.2), 1e-9);
  EXPECT_NEAR(battery.reading(0, 0), voltage_reading(3.0), 1e-9);
  const std::int64_t drain = battery.drain({255, 255, 0, false, false});
  const double amperes = (6.5 + 36) * 1e-3;
  EXPECT_NEAR(battery.reading(battery.capacity(), 0) - battery.reading(battery.capacity(), drain),
              voltage_reading(2 * amperes), 1e-6);
}

TEST(Battery, IsSuppliedOnAChargerAndNowhereElse) {
  const RunPlan plan = plan_of(
      "charger { x_mm: 100 radius_mm: 30 current_mA: 90 } charger { x_mm: 140 radius_mm: 30 current_mA: 45 }");
  const Battery battery(plan);
  const auto mA = [&](double x, double y) {
    return static_cast<double>(battery.supply(x, y)) / kUnitsPer_mAh * 3600 / 0.032768;
  };
  EXPECT_EQ(battery.supply(0, 0), 0);
  EXPECT_NEAR(mA(100, 29), 90, 1e-9);
  EXPECT_EQ(battery.supply(100, 31), 0);
  EXPECT_NEAR(mA(169, 0), 45, 1e-9);
  EXPECT_NEAR(mA(120, 0), 90, 1e-9) << "the stronger of two";
}

TEST(Battery, StartsWithTheStatedCharge) {
  const RunPlan half = plan_of("charge: 0.5");
  const Battery battery(half);
  EXPECT_NEAR(static_cast<double>(battery.initial(0)), 0.5 * 160 * kUnitsPer_mAh, 1);
  const RunPlan spread = plan_of("charge: 0.5 charge_sd: 0.1", 1000);
  const Battery spread_battery(spread);
  double sum = 0, squares = 0;
  for (std::uint32_t robot = 0; robot < 1000; ++robot) {
    const double part =
        static_cast<double>(spread_battery.initial(robot)) / static_cast<double>(spread_battery.capacity()) - 0.5;
    sum += part;
    squares += part * part;
  }
  EXPECT_NEAR(sum / 1000, 0, 4 * 0.1 / std::sqrt(1000.0));
  EXPECT_NEAR(std::sqrt(squares / 1000), 0.1, 4 * 0.1 / std::sqrt(2000.0));
}

}  // namespace
}  // namespace kilotwin::senses
