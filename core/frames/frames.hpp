/// The data that engines exchange once per tick. The plain form of idl/frames.idl, which describes every field; the headers
/// that only the wire needs (publisher, run, directives) are added by core/federation/wire.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/pose.hpp"
#include "core/base/time.hpp"
#include "core/frames/overhead_packet.hpp"

namespace kilotwin {

/// Movable bodies, structure of arrays, ascending numbers.
struct MovableColumns {
  std::vector<std::uint32_t> body;
  std::vector<double> x_mm, y_mm, heading_rad;  ///< of the centre; heading in [-pi, pi)
  std::vector<double> vx_mm, vy_mm, turn_rad;

  void clear() {
    body.clear();
    for (auto* column : {&x_mm, &y_mm, &heading_rad, &vx_mm, &vy_mm, &turn_rad}) column->clear();
  }
};

/// The contact cache of robots that touch others or slip against their drive; ascending ids.
struct ContactColumns {
  std::vector<std::uint32_t> robot;
  std::vector<double> slip_x_mm, slip_y_mm;  ///< per robot: velocity less that of its drive
  std::vector<std::uint8_t> count;           ///< per robot: how many entries of the next three are its own
  std::vector<std::uint32_t> other;          ///< ascending within a robot: another robot, or robots + movable body
  std::vector<double> normal_impulse_mm;     ///< above 0
  std::vector<double> tangent_impulse_mm;

  void clear() {
    robot.clear();
    slip_x_mm.clear();
    slip_y_mm.clear();
    count.clear();
    other.clear();
    normal_impulse_mm.clear();
    tangent_impulse_mm.clear();
  }
};

/// Poses of the robots that a partition owns, or of those that a neighbour must see. Ascending ids.
struct BodyFrame {
  Tick tick;
  std::vector<std::uint32_t> robot;
  std::vector<double> x_mm, y_mm, heading_rad;
  std::vector<double> spatial;  ///< of ghosts of the ODE engine: kSpatialColumns per robot, then per movable
                                ///< body; else empty

  static constexpr std::size_t kSpatialColumns = 11;
  MovableColumns movable;
  ContactColumns contact;      ///< in ghosts only
  std::vector<double> memory;  ///< RunPlan::memory.size() values per robot: what the model's effects remember of it

  void clear() {
    robot.clear();
    x_mm.clear();
    y_mm.clear();
    heading_rad.clear();
    spatial.clear();
    movable.clear();
    contact.clear();
    memory.clear();
  }
  void add(std::uint32_t id, double x, double y, double heading) {
    robot.push_back(id);
    x_mm.push_back(x);
    y_mm.push_back(y);
    heading_rad.push_back(heading);
  }
};

/// Outputs of the programs of one host; entry i belongs to robot first_robot + i.
struct ActuationFrame {
  Tick tick;
  std::uint32_t first_robot = 0;
  std::vector<std::uint8_t> motor_left, motor_right;  ///< duty 0..255; the left motor drives the right-hand leg
  std::vector<std::uint8_t> led;                      ///< r | g << 2 | b << 4
  std::vector<std::uint8_t> life_cycle;               ///< LifeCycle
  std::vector<std::uint16_t> tx_period;               ///< kilo_tx_period, counts of 128 us
  std::vector<std::uint32_t> offer_robot;             ///< ascending
  std::vector<IrMessage> offer_message;
  std::vector<std::uint16_t> offer_crc_error;  ///< per offer: its CRC XOR the right one; empty: all CRCs are right
  std::vector<std::uint8_t> spin_up;  ///< per robot, full duty of both motors in the tick: core/base/spin_up.hpp
};

/// Receptions and clocks that the radio passes to one host.
struct RadioFrame {
  Tick tick;
  std::uint32_t first_robot = 0;
  std::vector<std::uint8_t> kilo_ticks;          ///< per robot
  std::vector<std::uint32_t> ask;                ///< ascending
  std::vector<std::uint32_t> sent;               ///< ascending
  std::vector<std::uint32_t> reception_robot;    ///< ordered by robot, then by time of arrival
  std::vector<std::uint32_t> reception_message;  ///< index into messages
  std::vector<std::int16_t> reception_high_gain, reception_low_gain;
  std::vector<IrMessage> messages;
  std::vector<std::uint16_t> message_crc_error;  ///< per message, as offer_crc_error
  // Robots that run firmware: what their processors show at the end of the tick, which their host passes on.
  std::vector<std::uint32_t> firmware_robot;  ///< ascending
  std::vector<std::uint8_t> firmware_motor_left, firmware_motor_right, firmware_spin_up, firmware_led,
      firmware_life_cycle;
  std::vector<std::uint32_t> firmware_fault;  ///< 0, or cause << 24 | address in flash
};

/// Packets from the station to the overhead controller within one tick, by ascending offset.
struct OverheadFrame {
  Tick tick;
  std::vector<OverheadPacket> packets;
};

/// How a tracked robot is known; the numbers are those of the trackers' samples.
enum class TrackedState : std::uint8_t { kSeen = 0, kPredicted = 1, kLost = 2, kInDoubt = 3 };

/// An LED whose colour no tracker has measured.
inline constexpr std::uint8_t kUnknownLed = 255;

/// The station's poses of tracked robots: those that a tracker has seen and that are not lost. Ascending ids.
struct TrackingFrame {
  Tick tick;
  std::vector<std::uint32_t> robot;
  std::vector<std::uint8_t> state;              ///< TrackedState
  std::vector<double> x_mm, y_mm, heading_rad;  ///< predicted for tick + 1
  std::vector<std::uint8_t> led;                ///< r | g << 2 | b << 4, or kUnknownLed
  std::vector<std::uint32_t> said_robot;        ///< real robots that listeners heard; ascending ids
  std::vector<IrMessage> said_message;          ///< per entry of said_robot: what it said last

  void clear() {
    robot.clear();
    state.clear();
    x_mm.clear();
    y_mm.clear();
    heading_rad.clear();
    led.clear();
    said_robot.clear();
    said_message.clear();
  }
};

enum class Membership : std::uint8_t {
  kJoined = 0,
  kLeft = 1,  ///< it was seen outside the arena
  kLost = 2   ///< no tracker has seen it for the bridging time
};

/// From a tick on a tracked robot is there, or is absent: without a body, silent and deaf.
struct MembershipChange {
  std::uint32_t robot = 0;
  Membership membership = Membership::kJoined;
};

/// A simulated robot or a movable body is placed elsewhere, as by hand: its pose after a step. The step's motion of the body
/// is lost, it stands still, and the effects' memory of the robot is reset.
struct Relocation {
  bool movable = false;  ///< whether `body` is the number of a movable body, else that of a robot
  std::uint32_t body = 0;
  Pose pose;
};

}  // namespace kilotwin
