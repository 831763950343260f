/// Stand-in for physics and behaviours hosts, so that tests and benchmarks can run the radio engine alone: robots at rest
/// whose programs answer every request for a message. Timeline as in core/frames/frames.hpp: actuation frame k+1 answers a
/// request of tick k, and a slot stays full until its message is reported as sent.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/plan/plan.hpp"
#include "services/comm/radio_engine.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::testing {

/// Frames of one tick as all partitions and hosts of a plan would publish them.
class FakeHosts {
 public:
  explicit FakeHosts(const RunPlan& plan)
      : life_cycle(plan.robots(), static_cast<std::uint8_t>(LifeCycle::kRunning)),
        tx_period(plan.robots(), 3906),
        sends(plan.robots(), 1),
        plan_(plan),
        bodies_(plan.grid.size()),
        actuation_(plan.hosts),
        swarm_(plan.robots(), 0, 0),
        slot_(plan.robots(), 0) {
    for (std::uint32_t i = 0; i < plan.robots(); ++i) poses.push_back({});
    for (std::uint32_t i = 0; i < plan.robots(); ++i) {
      const Pose pose = plan.initial_pose(i);
      poses[i] = {pose.x_mm, pose.y_mm, pose.heading_rad};
    }
    for (std::uint32_t h = 0; h < plan.hosts; ++h) {
      const Share share = plan.share(HostId{h});
      ActuationFrame& frame = actuation_[h];
      frame = motors(Tick{0}, std::vector<std::uint8_t>(share.size(), 0),
                     std::vector<std::uint8_t>(share.size(), 0), share.first);
      for (std::uint32_t i = 0; i < share.size(); ++i) {
        frame.life_cycle[i] = life_cycle[share.first + i];
        frame.tx_period[i] = tx_period[share.first + i];
      }
    }
    for (const BodyFrame& frame : bodies_) body_frames_.push_back(&frame);
    for (const ActuationFrame& frame : actuation_) actuation_frames_.push_back(&frame);
    place();
  }
  FakeHosts(const FakeHosts&) = delete;
  FakeHosts& operator=(const FakeHosts&) = delete;

  // Outputs of the programs; a change takes effect at the next answer().
  std::vector<std::uint8_t> life_cycle;
  std::vector<std::uint16_t> tx_period;
  std::vector<std::uint8_t> sends;  ///< 0: kilo_message_tx returns NULL
  /// The message that a robot hands over.
  std::function<IrMessage(std::uint32_t robot, Tick)> message = [](std::uint32_t robot, Tick tick) {
    const auto t = static_cast<std::uint64_t>(tick.count());
    return IrMessage{static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(robot >> 8),
                     static_cast<std::uint8_t>(t), static_cast<std::uint8_t>(t >> 8)};
  };
  /// Its CRC XOR the right one.
  std::function<std::uint16_t(std::uint32_t robot, Tick)> crc_error = [](std::uint32_t, Tick) {
    return std::uint16_t{0};
  };
  std::vector<ScenePose> poses;
  OverheadFrame overhead;

  /// Inputs of the radio's step from `now`.
  [[nodiscard]] comm::RadioEngine::Inputs inputs(Tick now) {
    swarm_.gather(now, body_frames_);
    swarm_.gather(actuation_frames_);
    return {swarm_, overhead};
  }

  /// Lists the robots in the frames of the partitions that contain their positions.
  void place() {
    for (BodyFrame& frame : bodies_) frame.clear();
    for (std::uint32_t i = 0; i < poses.size(); ++i) {
      const ScenePose& p = poses[i];
      bodies_[plan_.grid.owner(p.x_mm, p.y_mm).value()].add(i, p.x_mm, p.y_mm, p.heading_rad);
    }
  }

  /// The hosts' step from tick `from` with the radio frame of that tick.
  void answer(Tick from, HostId host, const RadioFrame& radio) {
    ActuationFrame& frame = actuation_[host.value()];
    const Share share = plan_.share(host);
    frame.tick = from + 1;
    frame.offer_robot.clear();
    frame.offer_message.clear();
    frame.offer_crc_error.clear();
    for (const std::uint32_t robot : radio.sent) slot_[robot] = 0;
    for (std::uint32_t i = share.first; i < share.last; ++i) {
      frame.life_cycle[i - share.first] = life_cycle[i];
      frame.tx_period[i - share.first] = tx_period[i];
      if (!running(i)) slot_[i] = 0;
    }
    for (const std::uint32_t robot : radio.ask) {
      if (slot_[robot] != 0 || sends[robot] == 0 || !running(robot)) continue;
      slot_[robot] = 1;
      frame.offer_robot.push_back(robot);
      frame.offer_message.push_back(message(robot, from));
      frame.offer_crc_error.push_back(crc_error(robot, from));
    }
  }

 private:
  [[nodiscard]] bool running(std::uint32_t i) const {
    return life_cycle[i] == static_cast<std::uint8_t>(LifeCycle::kRunning);
  }

  const RunPlan& plan_;
  std::vector<BodyFrame> bodies_;
  std::vector<ActuationFrame> actuation_;
  std::vector<const BodyFrame*> body_frames_;
  std::vector<const ActuationFrame*> actuation_frames_;
  SwarmView swarm_;
  std::vector<std::uint8_t> slot_;
};

/// A radio engine with fake hosts around it.
class Swarm {
 public:
  explicit Swarm(const RunPlan& plan) : radio(plan), hosts(plan), frames(plan.hosts) { emit(); }

  comm::RadioEngine radio;
  FakeHosts hosts;
  Tick now;
  std::vector<RadioFrame> frames;  ///< of `now`, per host

  /// Advances by one tick. Packets in hosts.overhead are sent once.
  void step() {
    radio.step(now, hosts.inputs(now));
    hosts.overhead.packets.clear();
    for (std::uint32_t h = 0; h < frames.size(); ++h) hosts.answer(now, HostId{h}, frames[h]);
    ++now;
    emit();
  }
  void emit() {
    for (std::uint32_t h = 0; h < frames.size(); ++h) radio.emit(HostId{h}, frames[h]);
  }
};

}  // namespace kilotwin::testing
