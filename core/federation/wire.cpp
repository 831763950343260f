#include "core/federation/wire.hpp"

#include <cstring>
#include <numeric>

namespace kilotwin {
namespace {

static_assert(sizeof(IrMessage) == 10);
static_assert(sizeof(OverheadPacket) == 134 && alignof(OverheadPacket) == 1);

// A wire sequence that borrows `count` elements. Cyclone only reads it.
template <class Sequence, class T> Sequence borrow(const T* data, std::size_t count) {
  using Element = std::remove_pointer_t<decltype(Sequence::_buffer)>;
  Sequence sequence{};
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(count * sizeof(T) / sizeof(Element));
  sequence._buffer = const_cast<Element*>(reinterpret_cast<const Element*>(data));
  sequence._release = false;
  return sequence;
}

template <class Sequence, class T> Sequence borrow(const std::vector<T>& values) {
  return borrow<Sequence>(values.data(), values.size());
}

// Copies a wire sequence into a vector of T. Returns false if its size is not a multiple of that of T.
template <class Sequence, class T> bool copy(const Sequence& sequence, std::vector<T>& values) {
  constexpr std::size_t value_octets = sizeof(T), per_value = value_octets / sizeof(*Sequence::_buffer);
  if (sequence._length % per_value != 0) return false;
  values.resize(sequence._length / per_value);
  if (sequence._length != 0)
    std::memcpy(static_cast<void*>(values.data()), sequence._buffer, values.size() * sizeof(T));
  return true;
}

using Octets = kilotwin_wire_Octets;
using Shorts = kilotwin_wire_Shorts;
using UShorts = kilotwin_wire_UShorts;
using ULongs = kilotwin_wire_ULongs;
using Doubles = kilotwin_wire_Doubles;

template <class Wire> Wire headed(const WireHeader& header, Tick tick) {
  Wire wire{};
  wire.publisher = header.publisher;
  wire.run = header.run;
  wire.directives = header.directives;
  wire.tick = tick.count();
  return wire;
}

}  // namespace

WireBodyFrame to_wire(const WireHeader& header, const BodyFrame& frame) {
  auto wire = headed<WireBodyFrame>(header, frame.tick);
  wire.robot = borrow<ULongs>(frame.robot);
  wire.x_mm = borrow<Doubles>(frame.x_mm);
  wire.y_mm = borrow<Doubles>(frame.y_mm);
  wire.heading_rad = borrow<Doubles>(frame.heading_rad);
  wire.spatial = borrow<Doubles>(frame.spatial);
  wire.movable = borrow<ULongs>(frame.movable.body);
  wire.movable_x_mm = borrow<Doubles>(frame.movable.x_mm);
  wire.movable_y_mm = borrow<Doubles>(frame.movable.y_mm);
  wire.movable_heading_rad = borrow<Doubles>(frame.movable.heading_rad);
  wire.movable_vx_mm = borrow<Doubles>(frame.movable.vx_mm);
  wire.movable_vy_mm = borrow<Doubles>(frame.movable.vy_mm);
  wire.movable_turn_rad = borrow<Doubles>(frame.movable.turn_rad);
  wire.contact_robot = borrow<ULongs>(frame.contact.robot);
  wire.slip_x_mm = borrow<Doubles>(frame.contact.slip_x_mm);
  wire.slip_y_mm = borrow<Doubles>(frame.contact.slip_y_mm);
  wire.contact_count = borrow<Octets>(frame.contact.count);
  wire.contact_other = borrow<ULongs>(frame.contact.other);
  wire.contact_normal_impulse_mm = borrow<Doubles>(frame.contact.normal_impulse_mm);
  wire.memory = borrow<Doubles>(frame.memory);
  wire.contact_tangent_impulse_mm = borrow<Doubles>(frame.contact.tangent_impulse_mm);
  return wire;
}

bool from_wire(const WireBodyFrame& wire, BodyFrame& frame) {
  frame.tick = Tick{wire.tick};
  const bool whole = copy(wire.robot, frame.robot) && copy(wire.x_mm, frame.x_mm) && copy(wire.y_mm, frame.y_mm) &&
                     copy(wire.heading_rad, frame.heading_rad) && copy(wire.spatial, frame.spatial) &&
                     copy(wire.memory, frame.memory);
  const std::size_t n = frame.robot.size();
  if (!whole || frame.x_mm.size() != n || frame.y_mm.size() != n || frame.heading_rad.size() != n) return false;
  MovableColumns& movable = frame.movable;
  if (!copy(wire.movable, movable.body) || !copy(wire.movable_x_mm, movable.x_mm) ||
      !copy(wire.movable_y_mm, movable.y_mm) || !copy(wire.movable_heading_rad, movable.heading_rad) ||
      !copy(wire.movable_vx_mm, movable.vx_mm) || !copy(wire.movable_vy_mm, movable.vy_mm) ||
      !copy(wire.movable_turn_rad, movable.turn_rad)) {
    return false;
  }
  if (!frame.spatial.empty() && frame.spatial.size() != BodyFrame::kSpatialColumns * (n + movable.body.size()))
    return false;
  for (const auto* column :
       {&movable.x_mm, &movable.y_mm, &movable.heading_rad, &movable.vx_mm, &movable.vy_mm, &movable.turn_rad}) {
    if (column->size() != movable.body.size()) return false;
  }
  ContactColumns& contact = frame.contact;
  if (!copy(wire.contact_robot, contact.robot) || !copy(wire.slip_x_mm, contact.slip_x_mm) ||
      !copy(wire.slip_y_mm, contact.slip_y_mm) || !copy(wire.contact_count, contact.count) ||
      !copy(wire.contact_other, contact.other) ||
      !copy(wire.contact_normal_impulse_mm, contact.normal_impulse_mm) ||
      !copy(wire.contact_tangent_impulse_mm, contact.tangent_impulse_mm)) {
    return false;
  }
  const std::size_t p = contact.robot.size();
  return contact.slip_x_mm.size() == p && contact.slip_y_mm.size() == p && contact.count.size() == p &&
         contact.other.size() == contact.normal_impulse_mm.size() &&
         contact.other.size() == contact.tangent_impulse_mm.size() &&
         std::accumulate(contact.count.begin(), contact.count.end(), std::size_t{0}) == contact.other.size();
}

WireActuationFrame to_wire(const WireHeader& header, const ActuationFrame& frame) {
  auto wire = headed<WireActuationFrame>(header, frame.tick);
  wire.first_robot = frame.first_robot;
  wire.motor_left = borrow<Octets>(frame.motor_left);
  wire.motor_right = borrow<Octets>(frame.motor_right);
  wire.led = borrow<Octets>(frame.led);
  wire.life_cycle = borrow<Octets>(frame.life_cycle);
  wire.tx_period = borrow<UShorts>(frame.tx_period);
  wire.offer_robot = borrow<ULongs>(frame.offer_robot);
  wire.offer_message = borrow<Octets>(frame.offer_message);
  wire.offer_crc_error = borrow<UShorts>(frame.offer_crc_error);
  wire.spin_up = borrow<Octets>(frame.spin_up);
  return wire;
}

bool from_wire(const WireActuationFrame& wire, ActuationFrame& frame) {
  frame.tick = Tick{wire.tick};
  frame.first_robot = wire.first_robot;
  const bool whole = copy(wire.motor_left, frame.motor_left) && copy(wire.motor_right, frame.motor_right) &&
                     copy(wire.led, frame.led) && copy(wire.life_cycle, frame.life_cycle) &&
                     copy(wire.tx_period, frame.tx_period) && copy(wire.offer_robot, frame.offer_robot) &&
                     copy(wire.offer_message, frame.offer_message) &&
                     copy(wire.offer_crc_error, frame.offer_crc_error) && copy(wire.spin_up, frame.spin_up);
  const std::size_t n = frame.motor_left.size();
  return whole && frame.motor_right.size() == n && frame.led.size() == n && frame.life_cycle.size() == n &&
         frame.tx_period.size() == n && frame.offer_message.size() == frame.offer_robot.size() &&
         (frame.offer_crc_error.empty() || frame.offer_crc_error.size() == frame.offer_robot.size()) &&
         frame.spin_up.size() == n;
}

WireRadioFrame to_wire(const WireHeader& header, const RadioFrame& frame) {
  auto wire = headed<WireRadioFrame>(header, frame.tick);
  wire.first_robot = frame.first_robot;
  wire.kilo_ticks = borrow<Octets>(frame.kilo_ticks);
  wire.ask = borrow<ULongs>(frame.ask);
  wire.sent = borrow<ULongs>(frame.sent);
  wire.reception_robot = borrow<ULongs>(frame.reception_robot);
  wire.reception_message = borrow<ULongs>(frame.reception_message);
  wire.reception_high_gain = borrow<Shorts>(frame.reception_high_gain);
  wire.reception_low_gain = borrow<Shorts>(frame.reception_low_gain);
  wire.messages = borrow<Octets>(frame.messages);
  wire.message_crc_error = borrow<UShorts>(frame.message_crc_error);
  wire.firmware_robot = borrow<ULongs>(frame.firmware_robot);
  wire.firmware_motor_left = borrow<Octets>(frame.firmware_motor_left);
  wire.firmware_motor_right = borrow<Octets>(frame.firmware_motor_right);
  wire.firmware_spin_up = borrow<Octets>(frame.firmware_spin_up);
  wire.firmware_led = borrow<Octets>(frame.firmware_led);
  wire.firmware_life_cycle = borrow<Octets>(frame.firmware_life_cycle);
  wire.firmware_fault = borrow<ULongs>(frame.firmware_fault);
  return wire;
}

bool from_wire(const WireRadioFrame& wire, RadioFrame& frame) {
  frame.tick = Tick{wire.tick};
  frame.first_robot = wire.first_robot;
  const bool whole =
      copy(wire.kilo_ticks, frame.kilo_ticks) && copy(wire.ask, frame.ask) && copy(wire.sent, frame.sent) &&
      copy(wire.reception_robot, frame.reception_robot) && copy(wire.reception_message, frame.reception_message) &&
      copy(wire.reception_high_gain, frame.reception_high_gain) &&
      copy(wire.reception_low_gain, frame.reception_low_gain) && copy(wire.messages, frame.messages) &&
      copy(wire.message_crc_error, frame.message_crc_error) && copy(wire.firmware_robot, frame.firmware_robot) &&
      copy(wire.firmware_motor_left, frame.firmware_motor_left) &&
      copy(wire.firmware_motor_right, frame.firmware_motor_right) &&
      copy(wire.firmware_spin_up, frame.firmware_spin_up) && copy(wire.firmware_led, frame.firmware_led) &&
      copy(wire.firmware_life_cycle, frame.firmware_life_cycle) && copy(wire.firmware_fault, frame.firmware_fault);
  const std::size_t n = frame.reception_robot.size(), f = frame.firmware_robot.size();
  return whole && frame.reception_message.size() == n && frame.reception_high_gain.size() == n &&
         frame.reception_low_gain.size() == n && frame.firmware_motor_left.size() == f &&
         frame.firmware_motor_right.size() == f && frame.firmware_led.size() == f &&
         frame.firmware_spin_up.size() == f && frame.firmware_life_cycle.size() == f &&
         frame.firmware_fault.size() == f &&
         (frame.message_crc_error.empty() || frame.message_crc_error.size() == frame.messages.size());
}

WireOverheadFrame to_wire(const WireHeader& header, const OverheadFrame& frame) {
  auto wire = headed<WireOverheadFrame>(header, frame.tick);
  wire.packet = borrow<Octets>(frame.packets);
  return wire;
}

WireTrackingFrame to_wire(const WireHeader& header, const TrackingFrame& frame) {
  auto wire = headed<WireTrackingFrame>(header, frame.tick);
  wire.robot = borrow<ULongs>(frame.robot);
  wire.state = borrow<Octets>(frame.state);
  wire.x_mm = borrow<Doubles>(frame.x_mm);
  wire.y_mm = borrow<Doubles>(frame.y_mm);
  wire.heading_rad = borrow<Doubles>(frame.heading_rad);
  wire.led = borrow<Octets>(frame.led);
  wire.said_robot = borrow<ULongs>(frame.said_robot);
  wire.said_message = borrow<Octets>(frame.said_message);
  return wire;
}

bool from_wire(const WireTrackingFrame& wire, TrackingFrame& frame) {
  frame.tick = Tick{wire.tick};
  const bool whole = copy(wire.robot, frame.robot) && copy(wire.state, frame.state) &&
                     copy(wire.x_mm, frame.x_mm) && copy(wire.y_mm, frame.y_mm) &&
                     copy(wire.heading_rad, frame.heading_rad) && copy(wire.led, frame.led) &&
                     copy(wire.said_robot, frame.said_robot) && copy(wire.said_message, frame.said_message);
  const std::size_t n = frame.robot.size();
  return whole && frame.said_message.size() == frame.said_robot.size() && frame.state.size() == n &&
         frame.x_mm.size() == n && frame.y_mm.size() == n && frame.heading_rad.size() == n && frame.led.size() == n;
}

WireDirective to_wire(std::uint64_t run, const Directive& directive) {
  WireDirective wire{};
  wire.sequence_number = directive.sequence_number;
  wire.run = run;
  wire.tick = directive.tick.count();
  wire.kind = static_cast<kilotwin_wire_DirectiveKind>(directive.kind);
  wire.steps = directive.steps;
  if (directive.kind == DirectiveKind::kOverheadInput) {
    wire.packet = borrow<decltype(wire.packet)>(&directive.packet, 1);
  }
  if (directive.kind == DirectiveKind::kMembership) {
    wire.robot = directive.membership.robot;
    wire.membership = static_cast<std::uint8_t>(directive.membership.membership);
  }
  if (directive.kind == DirectiveKind::kRelocation) {
    const auto& [movable, body, pose] = directive.relocation;
    wire.robot = body;
    wire.movable = movable;
    wire.x_mm = pose.x_mm;
    wire.y_mm = pose.y_mm;
    wire.heading_rad = pose.heading_rad;
  }
  return wire;
}

bool from_wire(const WireDirective& wire, Directive& directive) {
  directive.sequence_number = wire.sequence_number;
  directive.tick = Tick{wire.tick};
  directive.kind = static_cast<DirectiveKind>(wire.kind);
  directive.steps = wire.steps;
  directive.membership = {wire.robot, static_cast<Membership>(wire.membership)};
  directive.relocation = {wire.movable, wire.robot, {wire.x_mm, wire.y_mm, wire.heading_rad}};
  if (directive.kind != DirectiveKind::kOverheadInput) return true;
  if (wire.packet._length != sizeof(OverheadPacket)) return false;
  std::memcpy(static_cast<void*>(&directive.packet), wire.packet._buffer, sizeof(OverheadPacket));
  return true;
}

bool from_wire(const WireOverheadFrame& wire, OverheadFrame& frame) {
  frame.tick = Tick{wire.tick};
  return copy(wire.packet, frame.packets);
}

}  // namespace kilotwin
