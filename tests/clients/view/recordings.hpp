/// Recordings of any size for tests and measurements, written by the recorder: robots on circles, a state every `every_s`.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "clients/recorder/writer.hpp"
#include "core/base/pose.hpp"
#include "core/frames/overhead_packet.hpp"

namespace kilotwin::test {

struct Circling {
  std::uint32_t robots = 20;
  int states = 50;
  double every_s = 0.5;
  bool floors = false;   ///< the first at the start, another in the middle
  bool outside = false;  ///< a tracker sees robots 0 to 9, and every tenth state a packet comes from outside
  bool flights = false;  ///< before each state but the first, every tenth robot receives a message of its successor
  bool placed = false;   ///< robot 4 is placed at 120, -80 mm, heading 90 degrees, 50 s after the start
  bool jumps = false;    ///< robot 4 is 700 mm further right than it would be, 30 s after the start and later
  bool inside = false;   ///< variables "count", of two hosts, and "part" of every second robot; events SENT
  bool observables = false;  ///< "far" of poses, and "most" of the variable "count" and of the displacement
};

/// The value of "count" of a robot in state `number`; "part" is half of it.
inline std::int64_t circling_count(std::uint32_t robot, int number) { return 3 * number - 2 * std::int64_t{robot}; }

/// Both variables and one SENT event per robot with an odd number, as two hosts report them, the second host first.
inline void write_inside(recorder::Writer& writer, std::int64_t tick, std::uint32_t robots, int number) {
  for (const std::uint32_t first : {robots / 2, 0u}) {
    proto::VariableRecord count, part;
    proto::EventRecord sent;
    count.set_variable(0);
    part.set_variable(1);
    sent.set_kind(proto::SENT);
    for (auto* record : {&count, &part}) record->set_tick(tick);
    sent.set_tick(tick);
    for (std::uint32_t i = first; i < (first == 0 ? robots / 2 : robots); ++i) {
      count.add_robot(i);
      count.add_integer(circling_count(i, number));
      if (i % 2 == 0) {
        part.add_robot(i);
        part.add_number(0.5 * static_cast<double>(circling_count(i, number)));
      } else {
        sent.add_robot(i);
        sent.add_offset_cycles(0);
      }
    }
    writer.variable(count);
    writer.variable(part);
    writer.event(sent);
  }
}

/// Half the width and height of the arena: room for all of them.
inline double circling_half_mm(std::uint32_t robots) { return std::max(1000.0, 28 * std::sqrt(robots)); }

/// Of one of `robots`: they stand like the seeds of a sunflower, and turn around the origin.
inline Pose circling_pose(std::uint32_t robot, std::uint32_t robots, double time_s) {
  const double radius_mm = 0.95 * circling_half_mm(robots) * std::sqrt((robot + 0.5) / robots);
  const double angle = 2.399963 * robot + 0.02 * time_s;
  return {radius_mm * std::cos(angle), radius_mm * std::sin(angle), wrapped(std::fmod(angle, 2 * kPi) + kPi / 2)};
}

inline proto::FloorRecord plain_floor(std::int64_t tick, char shade) {
  proto::FloorRecord floor;
  floor.set_tick(tick);
  floor.set_environment(0);
  floor.set_columns(2);
  floor.set_rows(1);
  floor.set_rgba(std::string{shade, 0, 0, shade, 0, shade, 0, shade});
  return floor;
}

/// A tracker's statement of robots 0 to 9: standard deviations of 40 mm and 10 mm, the longer one along the diagonal.
inline proto::TrackerRecord circling_sample(std::int64_t tick, std::uint32_t robots, double time_s) {
  proto::TrackerRecord sample;
  sample.set_tick(tick);
  sample.set_source(0);
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Pose pose = circling_pose(i, robots, time_s);
    sample.add_robot(i);
    sample.add_x(static_cast<float>(pose.x_mm));
    sample.add_y(static_cast<float>(pose.y_mm));
    sample.add_heading_rad(static_cast<float>(pose.heading_rad));
    sample.add_xx(850);
    sample.add_xy(750);
    sample.add_yy(850);
    sample.add_heading_variance_rad2(1);
    sample.mutable_state()->push_back(i == 9 ? 2 : 0);  // the tracker has lost robot 9
    sample.mutable_led()->push_back(0);
  }
  return sample;
}

inline proto::InputRecord circling_packet(std::int64_t tick, int number) {
  proto::InputRecord input;
  input.set_sequence_number(static_cast<std::uint64_t>(number));
  input.set_tick(tick);
  input.set_kind(proto::InputRecord::OVERHEAD_INPUT);
  OverheadPacket packet;
  packet.command = OverheadCommand::kOnce;
  packet.message[0] = static_cast<std::uint8_t>(number);
  packet.message[9] = 7;
  input.set_packet(octets_of(packet));
  input.set_packet_offset_cycles(0);
  return input;
}

inline proto::InputRecord circling_placement(std::int64_t tick) {
  proto::InputRecord input;
  input.set_sequence_number(1000);
  input.set_tick(tick);
  input.set_kind(proto::InputRecord::RELOCATION);
  input.set_robot(4);
  input.set_x_mm(120);
  input.set_y_mm(-80);
  input.set_heading_rad(kPi / 2);
  return input;
}

/// In the middle of a tick; robots 0, 10, 20... receive, and robots 1, 11, 21... have sent.
inline proto::EventRecord circling_flights(std::int64_t tick, std::uint32_t robots) {
  proto::EventRecord event;
  event.set_tick(tick);
  event.set_kind(proto::RECEIVED);
  for (std::uint32_t i = 0; i + 1 < robots; i += 10) {
    event.add_robot(i);
    event.add_sender(i + 1);
    event.add_distance_mm(50);
    event.add_offset_cycles(131072);
  }
  return event;
}

inline void write_circling(const std::filesystem::path& file, const Circling& plan) {
  proto::RecordingHeader header;
  header.set_format(recorder::kRecordingFormat);
  header.set_run(7);
  header.set_name("circling");
  header.set_seed(1);
  header.set_tick_cycles(262144);
  header.set_robots(plan.robots);
  header.set_every_s(plan.every_s);
  header.set_arena_width_mm(2 * circling_half_mm(plan.robots));
  header.set_arena_height_mm(2 * circling_half_mm(plan.robots));
  header.add_group_robots(plan.robots);
  if (plan.inside) {
    for (const bool integer : {true, false}) {
      proto::VariableColumn& column = *header.add_variable();
      column.set_name(integer ? "count" : "part");
      column.set_every_s(plan.every_s);
      column.set_integer(integer);
    }
    header.add_event(proto::SENT);
  }
  if (plan.flights) header.add_event(proto::RECEIVED);
  if (plan.observables) {
    proto::Observable& far = *header.add_observable();
    far.set_name("far");
    far.set_value("share(x_mm > 100)");
    proto::Observable& most = *header.add_observable();
    most.set_name("most");
    most.set_value("max(count) + msd / 1000");
  }
  recorder::Writer writer(file, header);
  const TickLength length{header.tick_cycles()};
  const recorder::RecordingSchedule schedule(length, plan.every_s);
  std::vector<double> x(plan.robots), y(plan.robots), heading(plan.robots);
  std::vector<std::uint8_t> led(plan.robots), life(plan.robots, 4);
  for (int number = 0; number < plan.states; ++number) {
    const Tick tick = schedule.tick(number);
    for (std::uint32_t i = 0; i < plan.robots; ++i) {
      const Pose pose = circling_pose(i, plan.robots, length.seconds_at(tick));
      x[i] = pose.x_mm + (plan.jumps && i == 4 && length.seconds_at(tick) >= 30 ? 700 : 0);
      y[i] = pose.y_mm;
      heading[i] = pose.heading_rad;
      led[i] = static_cast<std::uint8_t>((i + static_cast<std::uint32_t>(number) / 8) % 64);
    }
    if (plan.flights && number > 0) writer.event(circling_flights(tick.count() - 1, plan.robots));
    if (plan.placed && tick == length.at_or_after(50)) writer.input(circling_placement(tick.count()));
    if (plan.floors && number == 0) writer.floor(plain_floor(tick.count(), 10));
    if (plan.floors && number == plan.states / 2) writer.floor(plain_floor(tick.count(), 20));
    writer.state({tick, x, y, heading, led, life});
    if (plan.outside) writer.tracker(circling_sample(tick.count(), plan.robots, length.seconds_at(tick)));
    if (plan.outside && number % 10 == 0) writer.input(circling_packet(tick.count(), number / 10));
    // A federated run reports late.
    if (plan.inside && number > 0) write_inside(writer, schedule.tick(number - 1).count(), plan.robots, number - 1);
    for (std::int64_t k = 0; k < 16; ++k)
      writer.hash(Tick{tick.count() + k}, static_cast<std::uint64_t>(tick.count()));
  }
  if (plan.inside) write_inside(writer, schedule.tick(plan.states - 1).count(), plan.robots, plan.states - 1);
  proto::RadioRecord radio;
  for (std::uint32_t i = 0; i < plan.robots; ++i) {
    radio.add_attempted(i + 5);
    radio.add_sent(i + 3);
    radio.add_received(2 * i);
    radio.add_collided(1);
    radio.add_backed_off(2);
  }
  writer.radio(radio);
  proto::MessagesRecord messages;
  for (const auto& [receiver, sender, count] :
       {std::array{1u, 0u, 9u}, std::array{1u, 2u, 4u}, std::array{0u, 1u, 3u}, std::array{1u, 1u, 8u}}) {
    messages.add_receiver(receiver);
    messages.add_sender(sender);
    messages.add_count(count);
  }
  writer.messages(messages);
  writer.end(schedule.tick(plan.states - 1), 1);
}

}  // namespace kilotwin::test
