#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/services/ark/plugin_bench.hpp"

namespace kilotwin::ark {
namespace {

using station::BLUE;
using station::GREEN;
using station::lightColour;
using station::RED;

/// Food of 4 loads around (0, 0), 200 mm; home around (1000, 0), 50 mm; scent 700 mm.
class Field {
 public:
  std::optional<ArkMessage> at(double x_mm, lightColour colour, std::uint32_t robot = 3) {
    const station::Reply reply = bench.step({robot, {x_mm, 0, 0}, colour});
    EXPECT_EQ(reply.failure, "");
    // time, id, colour, x, y, orientation; then whether it carries, loads left, loads delivered.
    const std::string& row = reply.rows.at(robot);
    std::size_t place = 0;
    for (int tabs = 0; tabs < 6; ++tabs) place = row.find('\t', place) + 1;
    carries = row[place] == '1';
    loads_left = std::atoi(row.c_str() + place + 2);
    delivered = std::atoi(row.c_str() + row.rfind('\t'));
    food_radius_mm = reply.floor.circles.at(0).radius;
    home_radius_mm = reply.floor.circles.at(1).radius;
    for (const station::Sent& sent : reply.sent) {
      if (sent.id == robot) return ArkMessage{sent.id, sent.type, sent.data};
    }
    return std::nullopt;
  }

  PluginBench bench{"foraging",
                    {{"food_x_mm", "0"},
                     {"food_y_mm", "0"},
                     {"food_radius_mm", "200"},
                     {"home_x_mm", "1000"},
                     {"home_y_mm", "0"},
                     {"home_radius_mm", "50"},
                     {"scent_radius_mm", "700"},
                     {"loads", "4"}},
                    10};
  bool carries = false;
  int loads_left = 0, delivered = 0;
  double food_radius_mm = 0, home_radius_mm = 0;
};

TEST(ForagingPlugin, LeadsToTheFoodWithinItsScent) {
  Field food;
  EXPECT_EQ(food.at(0, GREEN), (ArkMessage{3, 0, 0}));
  EXPECT_EQ(food.at(200, GREEN), (ArkMessage{3, 0, 180}));
  EXPECT_EQ(food.at(201, GREEN), (ArkMessage{3, 3, 180}));
  EXPECT_EQ(food.at(-699, GREEN), (ArkMessage{3, 7, 0}));
  EXPECT_EQ(food.at(701, GREEN), std::nullopt);
}

TEST(ForagingPlugin, ALoadIsTakenAndPutDownByAsking) {
  Field food;
  EXPECT_EQ(food.at(231, BLUE), (ArkMessage{3, 3, 180}));  // too far
  EXPECT_EQ(food.loads_left, 4);
  EXPECT_EQ(food.at(229, BLUE), (ArkMessage{3, 14, 0}));
  EXPECT_TRUE(food.carries);
  EXPECT_EQ(food.loads_left, 3);
  EXPECT_EQ(food.food_radius_mm, 150);
  // It has not heard: told again, and nothing else changes.
  EXPECT_EQ(food.at(100, BLUE), (ArkMessage{3, 14, 0}));
  EXPECT_EQ(food.loads_left, 3);
  // Led home from everywhere; the type is 13 at most.
  EXPECT_EQ(food.at(100, RED), (ArkMessage{3, 10, 0}));
  EXPECT_EQ(food.at(-5000, RED), (ArkMessage{3, 13, 0}));
  EXPECT_EQ(food.at(1000, RED), (ArkMessage{3, 0, 0}));
  EXPECT_EQ(food.delivered, 0);
  EXPECT_EQ(food.at(1000, BLUE), (ArkMessage{3, 14, 1}));
  EXPECT_EQ(food.at(1000, BLUE), (ArkMessage{3, 14, 1}));
  EXPECT_FALSE(food.carries);
  EXPECT_EQ(food.delivered, 1);
  EXPECT_EQ(food.home_radius_mm, 100);
}

TEST(ForagingPlugin, LoadsAreNeitherMadeNorLost) {
  Field food;
  int carried = 0;
  for (std::uint32_t robot = 0; robot < 10; ++robot) {
    static_cast<void>(food.at(0, BLUE, robot));
    carried += food.carries ? 1 : 0;
  }
  EXPECT_EQ(carried, 4);
  EXPECT_EQ(food.loads_left, 0);
  EXPECT_EQ(food.food_radius_mm, 0);
  EXPECT_EQ(food.at(0, BLUE, 9), (ArkMessage{9, 15, 0}));
  for (std::uint32_t robot = 0; robot < 10; ++robot) static_cast<void>(food.at(1000, BLUE, robot));
  EXPECT_EQ(food.delivered, 4);
  EXPECT_EQ(food.home_radius_mm, 250);
}

TEST(ForagingPlugin, ACheckpointHoldsIt) {
  Field food, loaded;
  static_cast<void>(food.at(0, BLUE));
  static_cast<void>(loaded.at(0, GREEN));
  EXPECT_NE(food.bench.last_word, loaded.bench.last_word);
  const std::string state = food.bench.save();
  EXPECT_EQ(loaded.bench.load(state).failure, "");
  EXPECT_EQ(food.at(1000, BLUE), loaded.at(1000, BLUE));
  EXPECT_EQ(food.bench.last_word, loaded.bench.last_word);
  for (std::size_t cut = 0; cut < state.size(); ++cut)
    EXPECT_NE(loaded.bench.load(state.substr(0, cut)).failure, "") << cut;
  EXPECT_NE(loaded.bench.load(state + "x").failure, "");
}

}  // namespace
}  // namespace kilotwin::ark
