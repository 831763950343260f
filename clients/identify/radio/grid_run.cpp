#include "clients/identify/radio/grid_run.hpp"

#include "idl/manifest.pb.h"
#include "services/comm/radio_engine.hpp"

namespace kilotwin::radio_fit {
namespace {

/// kilo_tx_period of the firmware.
constexpr std::uint16_t kTxPeriod = 3906;
/// TAU_S is in units of 32 kilo_ticks.
constexpr double kTicksPerTau = 32;
/// The overhead controller sends RUN for 0.25 s, as in experiments, and jams the robots meanwhile.
constexpr std::int64_t kCall_ticks = 8;

RunPlan plan_of(const GridSet& set, const proto::Radio& radio, std::uint64_t seed) {
  proto::Manifest manifest;
  manifest.set_run(1);
  proto::Experiment& experiment = *manifest.mutable_experiment();
  experiment.set_seed(seed);
  *experiment.mutable_radio() = radio;
  experiment.mutable_recording()->set_messages(true);
  experiment.add_robots()->set_count(static_cast<std::uint32_t>(set.robots()));
  manifest.add_program()->set_path("ir_grid.c");
  manifest.add_group_program(0);
  for (int i = 0; i < set.robots(); ++i) {
    const Eigen::Vector2d place = set.place_mm(i);
    manifest.add_x_mm(place.x());
    manifest.add_y_mm(place.y());
    manifest.add_heading_rad(0);
  }
  return RunPlan(std::move(manifest));
}

}  // namespace

GridRun simulate(const GridSet& set, const proto::Radio& radio, std::uint64_t seed) {
  const RunPlan plan = plan_of(set, radio, seed);
  comm::RadioEngine engine(plan);
  const std::uint32_t robots = plan.robots();
  const auto pause = static_cast<std::uint32_t>(set.tau_s * kTicksPerTau);
  BodyFrame bodies;
  for (std::uint32_t i = 0; i < robots; ++i) {
    const Pose pose = plan.initial_pose(i);
    bodies.add(i, pose.x_mm, pose.y_mm, pose.heading_rad);
  }
  ActuationFrame actuation;
  actuation.motor_left.assign(robots, 0);
  actuation.motor_right.assign(robots, 0);
  actuation.spin_up.assign(robots, 0);
  actuation.led.assign(robots, 0);
  actuation.life_cycle.assign(robots, static_cast<std::uint8_t>(LifeCycle::kRunning));
  actuation.tx_period.assign(robots, kTxPeriod);
  OverheadFrame overhead;
  const BodyFrame* const body_frames[] = {&bodies};
  const ActuationFrame* const actuation_frames[] = {&actuation};
  SwarmView swarm(robots, 0, plan.memory.size());
  swarm.gather(Tick{0}, body_frames);
  std::vector<std::uint32_t> kilo_ticks(robots, 0), sent_at(robots, 0);
  std::vector<std::uint8_t> has_sent(robots, 0), holds(robots, 0);
  RadioFrame frame;
  std::uint32_t running = robots;
  for (Tick now; running > 0; ++now) {
    engine.emit(HostId{0}, frame);
    overhead.packets.clear();
    if (now.count() == 0) overhead.packets.push_back({OverheadCommand::kRepeat, {}});
    if (now.count() == kCall_ticks) overhead.packets.push_back({OverheadCommand::kStop, {}});
    swarm.gather(actuation_frames);
    engine.step(now, {swarm, overhead});
    actuation.offer_robot.clear();
    actuation.offer_message.clear();
    running = 0;
    for (std::uint32_t i = 0; i < robots; ++i) {
      kilo_ticks[i] += frame.kilo_ticks[i];
      running += kilo_ticks[i] < kDuration_kilo_ticks + 32 || holds[i] != 0;
    }
    for (const std::uint32_t i : frame.sent) {
      holds[i] = 0;
      has_sent[i] = 1;
      sent_at[i] = kilo_ticks[i];
    }
    for (const std::uint32_t i : frame.ask) {
      const bool pauses = has_sent[i] != 0 && kilo_ticks[i] - sent_at[i] < pause;
      if (holds[i] != 0 || kilo_ticks[i] >= kDuration_kilo_ticks || pauses) continue;
      holds[i] = 1;
      actuation.offer_robot.push_back(i);
      actuation.offer_message.push_back({});
    }
  }
  GridRun run;
  run.name = "seed" + std::to_string(seed);
  run.counts = Eigen::MatrixXd::Zero(robots, robots);
  for (const PairCount& pair : engine.pair_counts()) run.counts(pair.receiver, pair.sender) = pair.count;
  return run;
}

GridSet simulate(const GridSet& set, const proto::Radio& radio, int runs, std::uint64_t first_seed) {
  GridSet result = set;
  result.runs.clear();
  for (int k = 0; k < runs; ++k)
    result.runs.push_back(simulate(set, radio, first_seed + static_cast<std::uint64_t>(k)));
  return result;
}

}  // namespace kilotwin::radio_fit
