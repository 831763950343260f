// Frames changed at random never abort an engine: the checks of core/federation refuse them, the engine ends the run with a
// RunError, or it goes on. An abort ends the whole test program.
#include <gtest/gtest.h>

#include <memory>

#include "core/base/error.hpp"
#include "core/federation/frame_check.hpp"
#include "core/federation/wire.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/senses/robot_senses.hpp"
#include "services/ark/station_engine.hpp"
#include "services/comm/radio_engine.hpp"
#include "services/physics/engine.hpp"
#include "tests/services/frames/frame_mutation.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin {
namespace {

using test::mutate;
using Random = test::Random;

struct Scene {
  const char* name;
  const char* experiment;
};

class FrameFuzz : public ::testing::TestWithParam<Scene> {
 protected:
  static constexpr int kTrials = 400;
  static constexpr int kTicksAfter = 3;

  /// All engines but the behaviours hosts, and the frames between them.
  struct Run {
    explicit Run(const RunPlan& of)
        : plan(of),
          radio(of),
          station(of),
          senses(of, {0, of.robots()}),
          swarm(of.robots(), of.movables(), of.memory.size()) {
      for (std::uint32_t p = 0; p < plan.grid.size(); ++p)
        physics.push_back(physics::make_engine(plan, PartitionId{p}));
      actuation = testing::motors(Tick{0}, std::vector<std::uint8_t>(plan.robots(), 200),
                                  std::vector<std::uint8_t>(plan.robots(), 100));
      actuation.life_cycle.assign(plan.robots(), static_cast<std::uint8_t>(LifeCycle::kRunning));
      actuation.offer_robot = {1};
      actuation.offer_message = {IrMessage{3}};
      emit();
    }
    void emit() {
      bodies.resize(physics.size());
      ghosts.resize(physics.size());
      for (std::size_t p = 0; p < physics.size(); ++p) {
        physics[p]->emit_bodies(bodies[p]);
        ghosts[p].resize(physics[p]->neighbours().size());
        for (std::size_t i = 0; i < ghosts[p].size(); ++i)
          physics[p]->emit_ghosts(physics[p]->neighbours()[i], ghosts[p][i]);
      }
      station.emit(overhead);
      tracking.clear();
      tracking.tick = now;
      for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
        if (!plan.tracked(robot)) continue;
        const Pose pose = plan.initial_pose(robot);
        tracking.robot.push_back(robot);
        tracking.state.push_back(0);
        tracking.x_mm.push_back(pose.x_mm);
        tracking.y_mm.push_back(pose.y_mm);
        tracking.heading_rad.push_back(wrapped(pose.heading_rad));
        tracking.led.push_back(kUnknownLed);
      }
      actuation.tick = now;
    }
    void step() {
      std::vector<const BodyFrame*> all;
      for (const BodyFrame& frame : bodies) all.push_back(&frame);
      const ActuationFrame* const hosts[] = {&actuation};
      swarm.gather(now, all);
      swarm.gather(hosts);
      senses.at(swarm);
      for (std::uint32_t i = 0; i < plan.robots(); ++i) static_cast<void>(senses.readings(i));
      radio.step(now, {swarm, overhead});
      station.step(now, {swarm, {}});
      for (std::uint32_t p = 0; p < physics.size(); ++p) {
        std::vector<const BodyFrame*> in;
        for (std::size_t from = 0; from < physics.size(); ++from) {
          for (std::size_t i = 0; i < ghosts[from].size(); ++i)
            if (physics[from]->neighbours()[i] == PartitionId{p}) in.push_back(&ghosts[from][i]);
        }
        physics[p]->step(now, {in, hosts, &tracking});
      }
      ++now;
      emit();
    }
    const RunPlan& plan;
    std::vector<std::unique_ptr<physics::Engine>> physics;
    comm::RadioEngine radio;
    ark::StationEngine station;
    senses::RobotSenses senses;
    SwarmView swarm;
    Tick now;
    std::vector<BodyFrame> bodies;
    std::vector<std::vector<BodyFrame>> ghosts;
    ActuationFrame actuation;
    OverheadFrame overhead;
    TrackingFrame tracking;
  };

  /// Mutates the frame that `pick` finds, as a publisher would send it to `reader`.
  template <class Pick> void fuzz(FederateId publisher, FederateId reader, Pick pick) {
    const RunPlan plan =
        testing::make_plan(GetParam().experiment, testing::grid_crowd(12, 34, testing::Facing::kInwards), 2, 1);
    int refused = 0, accepted = 0, ended = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      SCOPED_TRACE(trial);
      Random random(static_cast<std::uint64_t>(trial));
      Run run(plan);
      for (int k = 0; k < trial % 4; ++k) run.step();
      auto& frame = pick(run);
      auto sent = frame;
      mutate(random, sent);
      auto received = frame;
      if (!from_wire(to_wire({publisher.value(), 1, 0}, sent), received) ||
          defect(received, plan, publisher, reader) != nullptr) {
        ++refused;
        continue;
      }
      ++accepted;
      frame = received;
      try {
        for (int k = 0; k < kTicksAfter; ++k) run.step();
      } catch (const RunError&) {
        ++ended;
      }
    }
    EXPECT_GT(refused, kTrials / 20);
    EXPECT_GT(accepted, kTrials / 50) << "nothing reached the engines";
    RecordProperty("ended", ended);
  }
};

TEST_P(FrameFuzz, BodiesToTheRadioAndTheStation) {
  fuzz(FederateId{0}, FederateId{2}, [](Run& run) -> BodyFrame& { return run.bodies[0]; });
}
TEST_P(FrameFuzz, GhostsToANeighbour) {
  fuzz(FederateId{0}, FederateId{1}, [](Run& run) -> BodyFrame& { return run.ghosts[0][0]; });
}
TEST_P(FrameFuzz, ActuationToAll) {
  fuzz(FederateId{4}, FederateId{0}, [](Run& run) -> ActuationFrame& { return run.actuation; });
}
TEST_P(FrameFuzz, OverheadPacketsToTheRadio) {
  fuzz(FederateId{3}, FederateId{2}, [](Run& run) -> OverheadFrame& { return run.overhead; });
}
TEST_P(FrameFuzz, TrackedRobotsToPhysics) {
  if (std::string_view(GetParam().name) != "Tracked") GTEST_SKIP() << "nobody is tracked";
  fuzz(FederateId{3}, FederateId{0}, [](Run& run) -> TrackingFrame& { return run.tracking; });
}

INSTANTIATE_TEST_SUITE_P(
    Engines, FrameFuzz,
    ::testing::Values(
        Scene{"Planar",
              "movable { box { width_mm: 100 length_mm: 40 } y_mm: 100 mass_g: 20 } station { environment { hub { "
              "radius_mm: 300 } } } light { shadows: true source { height_mm: 250 intensity: 88 } }"},
        Scene{"Ode",
              "physics { engine: ODE } movable { box { width_mm: 100 length_mm: 40 } y_mm: 100 mass_g: 20 }"},
        Scene{"Tracked", "robots { count: 8 } robots { count: 4 body: TRACKED }"},
        Scene{"Kinematic", "physics { engine: KINEMATIC } radio { model: SIMPLE }"},
        Scene{"Memory",
              "effect { name: 'a' acts_on: WHEEL_GAIN function { of: MOTOR_TIME linear { slope: -1e-4 } } } "
              "battery { }"}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace kilotwin
