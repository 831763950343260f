#include "core/experiment/clamp.hpp"

#include <gtest/gtest.h>

#include "core/experiment/fields.hpp"
#include "idl/model.pb.h"

namespace kilotwin {
namespace {

TEST(Clamp, MovesNumbersIntoTheRangesOfTheirFields) {
  proto::Model model;
  model.mutable_motion()->set_straight_speed_mm_s(-3);
  model.mutable_motion()->set_turn_speed_mm_s(1e9);
  model.mutable_motion()->set_wheel_base_mm(0);  // excluded
  model.mutable_motion()->set_bias_mean_mm_s(1.5);
  model.add_robot()->set_bias_left_mm_s(-1e6);
  model.add_effect()->add_function()->mutable_noise()->set_sd(-1);
  clamp_to_ranges(model);
  const proto::Motion& motion = model.motion();
  EXPECT_EQ(motion.straight_speed_mm_s(), 0);
  EXPECT_EQ(motion.turn_speed_mm_s(), 200);
  EXPECT_TRUE(rule_of(*motion.GetDescriptor()->FindFieldByName("wheel_base_mm"))->allows(motion.wheel_base_mm()));
  EXPECT_EQ(motion.bias_mean_mm_s(), 1.5) << "it is within";
  EXPECT_FALSE(motion.has_spin_up_s()) << "what is absent stays absent";
  EXPECT_EQ(model.robot(0).bias_left_mm_s(), -100);
  EXPECT_EQ(model.effect(0).function(0).noise().sd(), 0);
}

}  // namespace
}  // namespace kilotwin
