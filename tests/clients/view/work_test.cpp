// Where the time of federates goes, and the plan that a viewer makes of an experiment.
#include "clients/view/work.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "clients/recorder/summary.hpp"
#include "clients/view/watched_plan.hpp"
#include "core/plan/tracking_settings.hpp"
#include "idl/manifest.pb.h"
#include "services/physics/engine.hpp"

namespace kilotwin::view {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

proto::Experiment experiment() {
  proto::Experiment e;
  e.set_duration_s(10);
  e.mutable_arena()->set_width_mm(2000);
  e.mutable_arena()->set_height_mm(1000);
  e.add_robots()->set_count(5);
  e.mutable_deployment()->set_partition_columns(2);
  return e;
}

WireMetrics metrics_of(std::uint32_t federate, std::uint64_t step_ns, std::uint64_t wait_ns) {
  WireMetrics metrics{};
  metrics.publisher = federate;
  metrics.step_ns = step_ns;
  metrics.exchange_ns = 1'000'000;
  metrics.wait_ns = wait_ns;
  return metrics;
}

TEST(LiveWork, IsThatOfTheLastSeconds) {
  const auto plan = plan_of(experiment());
  ASSERT_TRUE(plan);
  LiveWork work;
  const LiveWork::Clock::time_point begin{};
  // At first the federate only waits, later it only computes.
  for (std::uint64_t second = 0; second <= 10; ++second)
    work.take(metrics_of(1, std::uint64_t{second > 5 ? second - 5 : 0} * 1'000'000'000,
                         std::min<std::uint64_t>(second, 5) * 1'000'000'000),
              begin + second * 1s);
  work.take(metrics_of(2, 5, 5), begin);
  work.take(metrics_of(99, 5, 5), begin);
  const std::vector<FederateTime> recent = work.recent(*plan);
  ASSERT_EQ(recent.size(), 1u) << "one report says nothing";
  EXPECT_EQ(recent[0].name, "physics 1,0");
  EXPECT_NEAR(recent[0].step_s, 5, 1.01);
  EXPECT_NEAR(recent[0].wait_s, 0, 1e-9);
  // A federate that was started again counts anew.
  work.take(metrics_of(1, 10, 20), begin + 11s);
  EXPECT_TRUE(work.recent(*plan).empty());
}

TEST(WorkText, NamesFederatesOrSubjects) {
  recorder::Summary summary;
  summary.cost_ns_per_robot_tick = {300, 200, 500, 0, 0, 10};
  summary.messages = {12, 10, 40, 1};
  summary.ticks = 100;
  summary.simulated_s = 3.2768;
  summary.wall_s = 0.5;
  const json local = json::parse(work_text(summary));
  EXPECT_TRUE(local["federates"].empty());
  EXPECT_EQ(local["cost"][2], (json{{"name", "radio"}, {"ns", 500.0}}));
  EXPECT_EQ(local["cost"].size(), 4u);
  EXPECT_EQ(local["sent"], 10u);
  EXPECT_EQ(local["received"], 40u);
  EXPECT_EQ(local["meanSpeed"], summary.realtime_factor());
  EXPECT_GT(summary.realtime_factor(), 0);
  summary.federates = {{"radio", 1, 0.5, 2}};
  const json federated = json::parse(work_text(summary));
  EXPECT_EQ(federated["federates"][0], (json{{"name", "radio"}, {"step", 1.0}, {"exchange", 0.5}, {"wait", 2.0}}));
  EXPECT_EQ(federated["cost"], local["cost"]);
}

TEST(WatchedPlan, HasTheMarginOfTheRunsOwnPlan) {
  for (const auto engine : {proto::Physics::PLANAR, proto::Physics::KINEMATIC, proto::Physics::ODE}) {
    proto::Experiment e = experiment();
    e.mutable_physics()->set_engine(engine);
    proto::Manifest manifest;
    manifest.set_run(7);
    *manifest.mutable_experiment() = e;
    manifest.add_group_program(0xffffffffu);
    for (int i = 0; i < 5; ++i) {
      manifest.add_x_mm(100 * i);
      manifest.add_y_mm(0);
      manifest.add_heading_rad(0);
    }
    const auto plan = plan_of(e);
    ASSERT_TRUE(plan);
    EXPECT_EQ(ghost_margin_mm(*plan), physics::ghost_margin_mm(RunPlan(manifest)));
    if (engine != proto::Physics::KINEMATIC) {
      EXPECT_GT(ghost_margin_mm(*plan), 33) << "robots that touch across a border know each other";
    }
  }
  proto::Experiment whole = experiment();
  whole.mutable_deployment()->set_partition_columns(1);
  EXPECT_EQ(ghost_margin_mm(*plan_of(whole)), 0);
  whole.mutable_deployment()->set_partition_columns(100);
  EXPECT_EQ(plan_of(whole), nullptr) << "too many partitions";
}

}  // namespace
}  // namespace kilotwin::view
