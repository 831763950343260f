/// The whole swarm at one tick, gathered once from the frames of all partitions and hosts: arrays by robot id. Radio,
/// station, sensors and recorder need more than one frame. They read this view instead of the frames.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/frames/frames.hpp"

namespace kilotwin {

class SwarmView {
 public:
  /// `memory`: values per robot that the model's effects remember (RunPlan::memory.size()).
  SwarmView(std::uint32_t robots, std::uint32_t movables, std::size_t memory);

  /// Takes the poses of `tick`, from the frames of all partitions in any order. Throws RunError where a robot is in none of
  /// them or in two.
  void gather(Tick tick, std::span<const BodyFrame* const>);
  /// Takes what programs have set, from frames of hosts in any order. Robots that no frame covers stay as they were, which
  /// at first is at rest and asleep.
  void gather(std::span<const ActuationFrame* const>);

  [[nodiscard]] std::uint32_t robots() const { return static_cast<std::uint32_t>(x_mm.size()); }

  // To be read only.
  Tick tick{-1};                                                        ///< of the poses
  std::vector<double> x_mm, y_mm, heading_rad;                          ///< per robot
  std::vector<double> memory;                                           ///< per robot, as in BodyFrame
  std::vector<double> movable_x_mm, movable_y_mm, movable_heading_rad;  ///< per movable body
  std::vector<std::uint8_t> motor_left, motor_right, spin_up;           ///< per robot, as in ActuationFrame
  std::vector<std::uint8_t> led, life_cycle;                            ///< per robot, as in ActuationFrame
  std::vector<std::uint16_t> tx_period;                                 ///< per robot, as in ActuationFrame
  std::vector<std::uint32_t> offer_robot;                               ///< as in ActuationFrame, host by host
  std::vector<IrMessage> offer_message;
  std::vector<std::uint16_t> offer_crc_error;  ///< as in ActuationFrame; of all offers

 private:
  std::size_t memory_size_;
  std::vector<std::uint32_t> listed_in_;  // per robot: the number of the gathering that listed it last
  std::uint32_t gathering_ = 0;
};

}  // namespace kilotwin
