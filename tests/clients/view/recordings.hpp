/// Recordings of any size for tests and measurements, written by the recorder: robots on circles, a state every `every_s`.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "clients/recorder/writer.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::test {

struct Circling {
  std::uint32_t robots = 20;
  int states = 50;
  double every_s = 0.5;
  bool floors = false;  ///< the first at the start, another in the middle
};

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
  recorder::Writer writer(file, header);
  const TickLength length{header.tick_cycles()};
  const recorder::RecordingSchedule schedule(length, plan.every_s);
  std::vector<double> x(plan.robots), y(plan.robots), heading(plan.robots);
  std::vector<std::uint8_t> led(plan.robots), life(plan.robots, 4);
  for (int number = 0; number < plan.states; ++number) {
    const Tick tick = schedule.tick(number);
    for (std::uint32_t i = 0; i < plan.robots; ++i) {
      const Pose pose = circling_pose(i, plan.robots, length.seconds_at(tick));
      x[i] = pose.x_mm;
      y[i] = pose.y_mm;
      heading[i] = pose.heading_rad;
      led[i] = static_cast<std::uint8_t>((i + static_cast<std::uint32_t>(number) / 8) % 64);
    }
    if (plan.floors && number == 0) writer.floor(plain_floor(tick.count(), 10));
    if (plan.floors && number == plan.states / 2) writer.floor(plain_floor(tick.count(), 20));
    writer.state({tick, x, y, heading, led, life});
    for (std::int64_t k = 0; k < 16; ++k)
      writer.hash(Tick{tick.count() + k}, static_cast<std::uint64_t>(tick.count()));
  }
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
