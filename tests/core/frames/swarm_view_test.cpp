#include "core/frames/swarm_view.hpp"

#include <gtest/gtest.h>

#include <string>

#include "core/base/error.hpp"

namespace kilotwin {
namespace {

/// The error of a gathering. Empty: none.
std::string refusal(SwarmView& view, const std::vector<BodyFrame>& bodies, Tick tick = Tick{3}) {
  std::vector<const BodyFrame*> frames;
  for (const BodyFrame& frame : bodies) frames.push_back(&frame);
  try {
    view.gather(tick, frames);
  } catch (const RunError& error) {
    return error.what();
  }
  return {};
}

ActuationFrame actuation(std::uint32_t first, const std::vector<std::uint8_t>& values) {
  ActuationFrame frame;
  frame.first_robot = first;
  frame.motor_left = frame.motor_right = frame.spin_up = frame.led = frame.life_cycle = values;
  for (std::uint8_t& right : frame.motor_right) right = static_cast<std::uint8_t>(right + 1);
  for (const std::uint8_t value : values) frame.tx_period.push_back(static_cast<std::uint16_t>(1000 + value));
  return frame;
}

TEST(SwarmView, PutsThePosesOfAllPartitionsInTheirPlaces) {
  SwarmView view(3, 2, 2);
  std::vector<BodyFrame> bodies(2);
  bodies[0].add(1, 10, 11, 0.1);
  bodies[0].memory = {5, 6};
  bodies[0].movable.body = {1};
  bodies[0].movable.x_mm = {70};
  bodies[0].movable.y_mm = {71};
  bodies[0].movable.heading_rad = {0.7};
  bodies[1].add(0, 20, 21, 0.2);
  bodies[1].add(2, 30, 31, 0.3);
  bodies[1].memory = {1, 2, 3, 4};
  ASSERT_EQ(refusal(view, bodies), "");
  EXPECT_EQ(view.tick, Tick{3});
  EXPECT_EQ(view.robots(), 3u);
  EXPECT_EQ(view.x_mm, (std::vector<double>{20, 10, 30}));
  EXPECT_EQ(view.y_mm, (std::vector<double>{21, 11, 31}));
  EXPECT_EQ(view.heading_rad, (std::vector<double>{0.2, 0.1, 0.3}));
  EXPECT_EQ(view.memory, (std::vector<double>{1, 2, 5, 6, 3, 4}));
  EXPECT_EQ(view.movable_x_mm, (std::vector<double>{0, 70}));
  EXPECT_EQ(view.movable_y_mm, (std::vector<double>{0, 71}));
  EXPECT_EQ(view.movable_heading_rad, (std::vector<double>{0, 0.7}));
}

TEST(SwarmView, RefusesARobotThatNoPartitionHas) {
  SwarmView view(3, 0, 0);
  std::vector<BodyFrame> bodies(2);
  EXPECT_EQ(refusal(view, bodies), "no partition has robot 0 at tick 3");
  bodies[0].add(0, 0, 0, 0);
  bodies[1].add(2, 0, 0, 0);
  EXPECT_EQ(refusal(view, bodies), "no partition has robot 1 at tick 3");
  bodies[1].add(1, 0, 0, 0);
  EXPECT_EQ(refusal(view, bodies), "");
  bodies[1].robot.pop_back();
  EXPECT_EQ(refusal(view, bodies, Tick{4}), "no partition has robot 1 at tick 4")
      << "what was gathered before counts no more";
}

TEST(SwarmView, RefusesARobotThatTwoPartitionsClaim) {
  SwarmView view(2, 0, 0);
  std::vector<BodyFrame> bodies(2);
  bodies[0].add(0, 0, 0, 0);
  bodies[0].add(1, 0, 0, 0);
  bodies[1].add(1, 0, 0, 0);
  EXPECT_EQ(refusal(view, bodies), "two partitions claim robot 1 at tick 3");
}

TEST(SwarmView, PutsOutputsOfProgramsInTheirPlaces) {
  SwarmView view(4, 0, 0);
  ActuationFrame second = actuation(2, {7, 8}), first = actuation(0, {1, 2});
  second.offer_robot = {3};
  second.offer_message = {IrMessage{9}};
  first.offer_robot = {0, 1};
  first.offer_message = {IrMessage{4}, IrMessage{5}};
  const ActuationFrame* const frames[] = {&first, &second};
  view.gather(frames);
  EXPECT_EQ(view.motor_left, (std::vector<std::uint8_t>{1, 2, 7, 8}));
  EXPECT_EQ(view.motor_right, (std::vector<std::uint8_t>{2, 3, 8, 9}));
  EXPECT_EQ(view.spin_up, view.motor_left);
  EXPECT_EQ(view.led, view.motor_left);
  EXPECT_EQ(view.life_cycle, view.motor_left);
  EXPECT_EQ(view.tx_period, (std::vector<std::uint16_t>{1001, 1002, 1007, 1008}));
  EXPECT_EQ(view.offer_robot, (std::vector<std::uint32_t>{0, 1, 3}));
  EXPECT_EQ(view.offer_message, (std::vector<IrMessage>{IrMessage{4}, IrMessage{5}, IrMessage{9}}));
  // Of a host that is not heard, everything stays; offers are of one tick.
  const ActuationFrame later = actuation(0, {3, 4});
  const ActuationFrame* const one[] = {&later};
  view.gather(one);
  EXPECT_EQ(view.led, (std::vector<std::uint8_t>{3, 4, 7, 8}));
  EXPECT_TRUE(view.offer_robot.empty());
}

}  // namespace
}  // namespace kilotwin
