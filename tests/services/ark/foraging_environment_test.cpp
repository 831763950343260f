#include "services/ark/foraging_environment.hpp"

#include <gtest/gtest.h>

#include "core/base/error.hpp"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

constexpr std::uint8_t kBlue = 0x30, kRed = 0x03, kGreen = 0x0c;

/// Food of 4 loads around (0, 0), 200 mm; home around (1000, 0), 50 mm; scent 700 mm.
ForagingEnvironment field() {
  ForagingSettings setting;
  setting.food_radius_mm = 200;
  setting.home_x_mm = 1000;
  setting.home_radius_mm = 50;
  setting.scent_radius_mm = 700;
  setting.loads = 4;
  return {setting, 10};
}

std::optional<ArkMessage> at(ForagingEnvironment& field, double x_mm, std::uint8_t led, std::uint32_t robot = 3) {
  return field.sense({robot, {x_mm, 0, 0}, led});
}

TEST(Foraging, LeadsToTheFoodWithinItsScent) {
  ForagingEnvironment food = field();
  EXPECT_EQ(at(food, 0, kGreen), (ArkMessage{3, 0, 0}));
  EXPECT_EQ(at(food, 200, kGreen), (ArkMessage{3, 0, 180}));
  EXPECT_EQ(at(food, 201, kGreen), (ArkMessage{3, 3, 180}));
  EXPECT_EQ(at(food, -699, kGreen), (ArkMessage{3, 7, 0}));
  EXPECT_EQ(at(food, 701, kGreen), std::nullopt);
}

TEST(Foraging, ALoadIsTakenAndPutDownByAsking) {
  ForagingEnvironment food = field();
  EXPECT_EQ(at(food, 231, kBlue), (ArkMessage{3, 3, 180}));  // too far
  EXPECT_EQ(food.loads_left(), 4u);
  EXPECT_EQ(at(food, 229, kBlue), (ArkMessage{3, 14, 0}));
  EXPECT_TRUE(food.carries(3));
  EXPECT_EQ(food.loads_left(), 3u);
  EXPECT_EQ(food.food_radius_mm(), 150);
  // It has not heard: told again, and nothing else changes.
  EXPECT_EQ(at(food, 100, kBlue), (ArkMessage{3, 14, 0}));
  EXPECT_EQ(food.loads_left(), 3u);
  // Led home from everywhere; the type is 13 at most.
  EXPECT_EQ(at(food, 100, kRed), (ArkMessage{3, 10, 0}));
  EXPECT_EQ(at(food, -5000, kRed), (ArkMessage{3, 13, 0}));
  EXPECT_EQ(at(food, 1000, kRed), (ArkMessage{3, 0, 0}));
  EXPECT_EQ(food.delivered(), 0u);
  EXPECT_EQ(at(food, 1000, kBlue), (ArkMessage{3, 14, 1}));
  EXPECT_EQ(at(food, 1000, kBlue), (ArkMessage{3, 14, 1}));
  EXPECT_FALSE(food.carries(3));
  EXPECT_EQ(food.delivered(), 1u);
  EXPECT_EQ(food.home_radius_mm(), 100);
}

TEST(Foraging, LoadsAreNeitherMadeNorLost) {
  ForagingEnvironment food = field();
  std::uint32_t carried = 0;
  for (std::uint32_t robot = 0; robot < 10; ++robot) {
    static_cast<void>(at(food, 0, kBlue, robot));
    carried += food.carries(robot);
  }
  EXPECT_EQ(carried, 4u);
  EXPECT_EQ(food.loads_left(), 0u);
  EXPECT_EQ(food.food_radius_mm(), 0);
  EXPECT_EQ(at(food, 0, kBlue, 9), (ArkMessage{9, 15, 0}));
  for (std::uint32_t robot = 0; robot < 10; ++robot) static_cast<void>(at(food, 1000, kBlue, robot));
  EXPECT_EQ(food.delivered(), 4u);
  EXPECT_EQ(food.home_radius_mm(), 250);
}

TEST(Foraging, ACheckpointHoldsIt) {
  ForagingEnvironment food = field(), loaded = field();
  static_cast<void>(at(food, 0, kBlue));
  EXPECT_NE(food.word(), loaded.word());
  proto::EnvironmentState state;
  food.save(state);
  loaded.load(state);
  EXPECT_EQ(food.word(), loaded.word());
  EXPECT_EQ(at(loaded, 1000, kBlue), at(food, 1000, kBlue));
  state.set_carries("123");
  EXPECT_THROW(loaded.load(state), RunError);
}

}  // namespace
}  // namespace kilotwin::ark
