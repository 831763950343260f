#include "core/frames/swarm_view.hpp"

#include <algorithm>
#include <string>

#include "core/base/error.hpp"

namespace kilotwin {

SwarmView::SwarmView(std::uint32_t robots, std::uint32_t movables, std::size_t memory_size)
    : x_mm(robots),
      y_mm(robots),
      heading_rad(robots),
      memory(robots * memory_size),
      movable_x_mm(movables),
      movable_y_mm(movables),
      movable_heading_rad(movables),
      motor_left(robots),
      motor_right(robots),
      spin_up(robots),
      led(robots),
      life_cycle(robots),
      tx_period(robots),
      memory_size_(memory_size),
      listed_in_(robots) {}

void SwarmView::gather(Tick of, std::span<const BodyFrame* const> frames) {
  tick = of;
  ++gathering_;
  std::size_t listed = 0;
  for (const BodyFrame* frame : frames) {
    listed += frame->robot.size();
    for (std::size_t i = 0; i < frame->robot.size(); ++i) {
      const std::uint32_t robot = frame->robot[i];
      if (listed_in_[robot] == gathering_)
        throw RunError("two partitions claim robot " + std::to_string(robot) + " at tick " +
                       std::to_string(of.count()));
      listed_in_[robot] = gathering_;
      x_mm[robot] = frame->x_mm[i];
      y_mm[robot] = frame->y_mm[i];
      heading_rad[robot] = frame->heading_rad[i];
    }
    if (memory_size_ > 0) {
      for (std::size_t i = 0; i < frame->robot.size(); ++i) {
        std::copy_n(frame->memory.begin() + static_cast<std::ptrdiff_t>(i * memory_size_), memory_size_,
                    memory.begin() + static_cast<std::ptrdiff_t>(frame->robot[i] * memory_size_));
      }
    }
    const MovableColumns& movable = frame->movable;
    for (std::size_t i = 0; i < movable.body.size(); ++i) {
      movable_x_mm[movable.body[i]] = movable.x_mm[i];
      movable_y_mm[movable.body[i]] = movable.y_mm[i];
      movable_heading_rad[movable.body[i]] = movable.heading_rad[i];
    }
  }
  if (listed == x_mm.size()) return;
  const auto missing = std::find_if(listed_in_.begin(), listed_in_.end(),
                                    [this](std::uint32_t gathering) { return gathering != gathering_; });
  throw RunError("no partition has robot " + std::to_string(missing - listed_in_.begin()) + " at tick " +
                 std::to_string(of.count()));
}

void SwarmView::gather(std::span<const ActuationFrame* const> frames) {
  offer_robot.clear();
  offer_message.clear();
  offer_crc_error.clear();
  for (const ActuationFrame* frame : frames) {
    const auto put = [first = frame->first_robot](const auto& from, auto& to) {
      std::copy(from.begin(), from.end(), to.begin() + first);
    };
    put(frame->motor_left, motor_left);
    put(frame->motor_right, motor_right);
    put(frame->spin_up, spin_up);
    put(frame->led, led);
    put(frame->life_cycle, life_cycle);
    put(frame->tx_period, tx_period);
    offer_robot.insert(offer_robot.end(), frame->offer_robot.begin(), frame->offer_robot.end());
    offer_message.insert(offer_message.end(), frame->offer_message.begin(), frame->offer_message.end());
    offer_crc_error.insert(offer_crc_error.end(), frame->offer_crc_error.begin(), frame->offer_crc_error.end());
    offer_crc_error.resize(offer_message.size(), 0);
  }
}

}  // namespace kilotwin
