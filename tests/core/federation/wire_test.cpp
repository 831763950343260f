#include "core/federation/wire.hpp"

#include <gtest/gtest.h>

namespace kilotwin {
namespace {

constexpr WireHeader kHeader{3, 0x1234567890abcdef, 2};

TEST(Wire, CarriesBodies) {
  BodyFrame out;
  out.tick = Tick{9};
  out.add(4, 1.5, -2.5, 0.25);
  out.add(8, -0.0, 1e-300, -3.0);
  const WireBodyFrame wire = to_wire(kHeader, out);
  EXPECT_EQ(wire.publisher, 3u);
  EXPECT_EQ(wire.run, 0x1234567890abcdefu);
  EXPECT_EQ(wire.directives, 2u);
  BodyFrame in;
  ASSERT_TRUE(from_wire(wire, in));
  EXPECT_EQ(in.tick, out.tick);
  EXPECT_EQ(in.robot, out.robot);
  EXPECT_EQ(in.x_mm, out.x_mm);
  EXPECT_EQ(in.y_mm, out.y_mm);
  EXPECT_EQ(in.heading_rad, out.heading_rad);
  EXPECT_EQ(in.spatial, out.spatial);
  // Check that the columns of the robots arrive complete.
  out.spatial.assign(BodyFrame::kSpatialColumns * out.robot.size(), 0.5);
  ASSERT_TRUE(from_wire(to_wire(kHeader, out), in));
  EXPECT_EQ(in.spatial, out.spatial);
  out.spatial.pop_back();
  EXPECT_FALSE(from_wire(to_wire(kHeader, out), in));
}

TEST(Wire, CarriesActuationAndRadioAndOverhead) {
  ActuationFrame actuation;
  actuation.tick = Tick{1};
  actuation.first_robot = 10;
  actuation.motor_left = {1, 2};
  actuation.motor_right = {3, 4};
  actuation.led = {5, 6};
  actuation.life_cycle = {4, 1};
  actuation.tx_period = {3906, 100};
  actuation.offer_robot = {11};
  actuation.spin_up = {0, 1};
  actuation.offer_message = {IrMessage{1, 2, 3, 4, 5, 6, 7, 8, 9, 0}};
  ActuationFrame actuation_in;
  ASSERT_TRUE(from_wire(to_wire(kHeader, actuation), actuation_in));
  EXPECT_EQ(actuation_in.first_robot, 10u);
  EXPECT_EQ(actuation_in.offer_message, actuation.offer_message);
  EXPECT_EQ(actuation_in.tx_period, actuation.tx_period);
  EXPECT_EQ(actuation_in.spin_up, actuation.spin_up);

  RadioFrame radio;
  radio.tick = Tick{2};
  radio.kilo_ticks = {1, 0, 2};
  radio.ask = {1};
  radio.sent = {2};
  radio.reception_robot = {0, 0, 2};
  radio.reception_message = {1, 0, 1};
  radio.reception_high_gain = {700, -1, 3};
  radio.reception_low_gain = {500, 0, 4};
  radio.messages = {IrMessage{}, IrMessage{9}};
  RadioFrame radio_in;
  ASSERT_TRUE(from_wire(to_wire(kHeader, radio), radio_in));
  EXPECT_EQ(radio_in.reception_high_gain, radio.reception_high_gain);
  EXPECT_EQ(radio_in.messages, radio.messages);

  OverheadFrame overhead;
  overhead.packets = {{OverheadCommand::kRepeat, IrMessage{8, 8}},
                      OverheadPacket{OverheadCommand::kStop, {}}.at(262143)};
  OverheadFrame overhead_in;
  ASSERT_TRUE(from_wire(to_wire(kHeader, overhead), overhead_in));
  ASSERT_EQ(overhead_in.packets.size(), 2u);
  EXPECT_EQ(overhead_in.packets[0].command, OverheadCommand::kRepeat);
  EXPECT_EQ(overhead_in.packets[0].message, overhead.packets[0].message);
  EXPECT_EQ(overhead_in.packets[0].offset_cycles(), 0u);
  EXPECT_EQ(overhead_in.packets[1].offset_cycles(), 262143u);
}

TEST(Wire, CarriesDirectives) {
  Directive out;
  out.sequence_number = 5;
  out.tick = Tick{77};
  out.kind = DirectiveKind::kOverheadInput;
  out.packet = {OverheadCommand::kOnce, IrMessage{1, 2, 3, 4, 5, 6, 7, 8, 9, 10}};
  WireDirective wire = to_wire(3, out);
  EXPECT_EQ(wire.run, 3u);
  Directive in;
  ASSERT_TRUE(from_wire(wire, in));
  EXPECT_EQ(in.sequence_number, 5u);
  EXPECT_EQ(in.tick, Tick{77});
  EXPECT_EQ(in.packet.command, OverheadCommand::kOnce);
  EXPECT_EQ(in.packet.message, out.packet.message);
  wire.packet._length = 10;
  EXPECT_FALSE(from_wire(wire, in));

  out.kind = DirectiveKind::kMembership;
  out.membership = {4, Membership::kLost};
  ASSERT_TRUE(from_wire(to_wire(3, out), in));
  EXPECT_EQ(in.membership.robot, 4u);
  EXPECT_EQ(in.membership.membership, Membership::kLost);

  out.kind = DirectiveKind::kRelocation;
  out.relocation = {true, 2, {1.5, -2.5, 0.25}};
  ASSERT_TRUE(from_wire(to_wire(3, out), in));
  EXPECT_TRUE(in.relocation.movable);
  EXPECT_EQ(in.relocation.body, 2u);
  EXPECT_EQ(in.relocation.pose.x_mm, 1.5);
  EXPECT_EQ(in.relocation.pose.y_mm, -2.5);
  EXPECT_EQ(in.relocation.pose.heading_rad, 0.25);
}

TEST(Wire, CarriesTrackedRobots) {
  TrackingFrame out;
  out.tick = Tick{9};
  out.robot = {3, 5};
  out.state = {0, 3};
  out.x_mm = {1.5, -2};
  out.y_mm = {3, 4};
  out.heading_rad = {0.1, -0.2};
  out.led = {7, kUnknownLed};
  TrackingFrame in;
  WireTrackingFrame wire = to_wire(kHeader, out);
  ASSERT_TRUE(from_wire(wire, in));
  EXPECT_EQ(in.tick, out.tick);
  EXPECT_EQ(in.robot, out.robot);
  EXPECT_EQ(in.state, out.state);
  EXPECT_EQ(in.x_mm, out.x_mm);
  EXPECT_EQ(in.led, out.led);
  wire.led._length = 1;
  EXPECT_FALSE(from_wire(wire, in));
}

TEST(Wire, RefusesArraysThatDisagree) {
  BodyFrame bodies;
  bodies.add(1, 2, 3, 4);
  WireBodyFrame wire = to_wire(kHeader, bodies);
  wire.y_mm._length = 0;
  BodyFrame in;
  EXPECT_FALSE(from_wire(wire, in));

  ActuationFrame actuation;
  actuation.offer_robot = {1};
  actuation.offer_message = {IrMessage{}};
  WireActuationFrame cut = to_wire(kHeader, actuation);
  cut.offer_message._length = 9;  // not a whole message
  ActuationFrame actuation_in;
  EXPECT_FALSE(from_wire(cut, actuation_in));
}

}  // namespace
}  // namespace kilotwin
