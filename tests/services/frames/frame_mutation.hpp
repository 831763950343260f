/// Changes frames at random, as a faulty or hostile publisher might send them.
#pragma once

#include <algorithm>
#include <iterator>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include "core/frames/frames.hpp"

namespace kilotwin::test {

using Random = std::mt19937_64;

template <class Visit> void each_field(BodyFrame& f, Visit visit) {
  visit(f.robot), visit(f.x_mm), visit(f.y_mm), visit(f.heading_rad), visit(f.spatial), visit(f.memory);
  MovableColumns& m = f.movable;
  visit(m.body), visit(m.x_mm), visit(m.y_mm), visit(m.heading_rad), visit(m.vx_mm), visit(m.vy_mm),
      visit(m.turn_rad);
  ContactColumns& c = f.contact;
  visit(c.robot), visit(c.slip_x_mm), visit(c.slip_y_mm), visit(c.count), visit(c.other),
      visit(c.normal_impulse_mm), visit(c.tangent_impulse_mm);
}

template <class Visit> void each_field(ActuationFrame& f, Visit visit) {
  visit(f.motor_left), visit(f.motor_right), visit(f.led), visit(f.life_cycle), visit(f.tx_period),
      visit(f.offer_robot);
  visit(f.offer_message), visit(f.offer_crc_error), visit(f.spin_up);
}

template <class Visit> void each_field(TrackingFrame& f, Visit visit) {
  visit(f.robot), visit(f.state), visit(f.x_mm), visit(f.y_mm), visit(f.heading_rad), visit(f.led);
}

template <class Visit> void each_field(OverheadFrame& f, Visit visit) { visit(f.packets); }

template <class Visit> void each_field(RadioFrame& f, Visit visit) {
  visit(f.kilo_ticks), visit(f.ask), visit(f.sent), visit(f.reception_robot), visit(f.reception_message),
      visit(f.reception_high_gain), visit(f.reception_low_gain), visit(f.messages), visit(f.message_crc_error);
  visit(f.firmware_robot), visit(f.firmware_motor_left), visit(f.firmware_motor_right), visit(f.firmware_spin_up),
      visit(f.firmware_led), visit(f.firmware_life_cycle), visit(f.firmware_fault);
}

inline std::size_t below(Random& random, std::size_t count) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

inline void change(Random& random, double& value) {
  const double odd[] = {0,
                        -0.0,
                        1,
                        -1,
                        16.4,
                        -50,
                        1e6,
                        -1e8,
                        2e9,
                        1e300,
                        1e-300,
                        std::numeric_limits<double>::infinity(),
                        std::numeric_limits<double>::quiet_NaN(),
                        value + 40,
                        value - 40,
                        -value};
  value = odd[below(random, std::size(odd))];
}
template <class Integer>
requires std::is_integral_v<Integer>
void change(Random& random, Integer& value) {
  const Integer odd[] = {0,
                         1,
                         2,
                         5,
                         static_cast<Integer>(value + 1),
                         static_cast<Integer>(value - 1),
                         std::numeric_limits<Integer>::max(),
                         static_cast<Integer>(random())};
  value = odd[below(random, std::size(odd))];
}
inline void change(Random& random, IrMessage& value) { change(random, value[below(random, value.size())]); }
inline void change(Random& random, OverheadPacket& value) {
  value.command = static_cast<OverheadCommand>(random() % 8);
  change(random, value.message);
  std::uint32_t offset = value.offset_cycles();
  change(random, offset);
  value = value.at(offset);
}

template <class T> void change(Random& random, std::vector<T>& values) {
  switch (random() % 6) {
    case 0:
      if (!values.empty()) values.pop_back();
      break;
    case 1:
      values.emplace_back();
      change(random, values.back());
      break;
    case 2: values.clear(); break;
    case 3:
      if (values.size() > 1) std::swap(values[below(random, values.size())], values[below(random, values.size())]);
      break;
    default:
      if (!values.empty()) change(random, values[below(random, values.size())]);
  }
}

/// Changes one to three fields; or takes out all robots, or adds one, so that lengths still agree.
template <class Frame> void mutate(Random& random, Frame& frame) {
  if constexpr (std::is_same_v<Frame, BodyFrame>) {
    if (random() % 4 == 0) {
      frame.robot.clear(), frame.x_mm.clear(), frame.y_mm.clear(), frame.heading_rad.clear(), frame.memory.clear();
      frame.spatial.resize(BodyFrame::kSpatialColumns *
                           std::min<std::size_t>(frame.spatial.size(), frame.movable.body.size()));
      frame.contact.clear();
      return;
    }
    if (random() % 4 == 0 && !frame.robot.empty() && frame.spatial.empty() && frame.memory.empty()) {
      frame.add(frame.robot.back() + 1, 0, 0, 0);
      return;
    }
  }
  std::size_t fields = 0;
  each_field(frame, [&](auto&) { ++fields; });
  for (std::size_t n = 1 + random() % 3; n > 0; --n) {
    std::size_t chosen = below(random, fields);
    each_field(frame, [&](auto& field) {
      if (chosen-- == 0) change(random, field);
    });
  }
}

}  // namespace kilotwin::test
