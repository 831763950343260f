// An observer sees what is recorded, outlives runs, and cannot act on one.
#include "clients/observe/observer.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <map>

#include "clients/recorder/reader.hpp"
#include "idl/experiment.pb.h"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::observe {
namespace {

using namespace std::chrono_literals;
using test::Process;
using test::Scratch;

constexpr const char* kExperiment = R"(
name: "observed"
duration_s: 4
arena { width_mm: 700 height_mm: 500 }
obstacle { x_mm: 250 y_mm: 150 cylinder { radius_mm: 30 } }
movable { x_mm: -250 y_mm: 0 mass_g: 60 box { width_mm: 60 length_mm: 40 } }
robots { count: 12 behaviour: "disperse.c" layout { grid { pitch_mm: 40 } } }
recording { every_s: 0.032768 }
)";

test::Words run_of(const std::string& experiment, const test::OwnDomain& domain, const std::string& out) {
  return {test::program(), "run", experiment, "--quiet", "--domain", domain.name, "--out", out};
}

/// Waits for a kind of news; other news are passed over.
bool await(Observer& observer, News wanted, double seconds = 60) {
  return test::eventually([&] { return observer.wait(10ms) == wanted; }, seconds);
}

class ObserverTest : public testing::Test {
 protected:
  void SetUp() override {
    test::write(scratch / "disperse.c", test::read(test::source("behaviours/disperse.c")));
    test::write(scratch / "observed.txtpb", kExperiment);
  }
  Scratch scratch;
};

TEST_F(ObserverTest, SeesTheStatesThatAreRecorded) {
  const test::OwnDomain domain;
  Observer observer({domain.number, {}});
  test::Words words = run_of(scratch / "observed.txtpb", domain, scratch / "run");
  words.insert(words.end(), {"--pace", "4", "--partitions", "2x1", "--hosts", "2"});
  Process run(words, scratch.path());
  ASSERT_TRUE(await(observer, News::kRunBegan));
  const RunFacts facts = *observer.run();
  EXPECT_EQ(facts.name, "observed");
  EXPECT_EQ(facts.robots, 12u);
  EXPECT_EQ(facts.movables, 1u);
  EXPECT_DOUBLE_EQ(facts.tick_s, 0.032768);
  EXPECT_EQ(facts.experiment->obstacle_size(), 1);
  EXPECT_EQ(facts.experiment->arena().width_mm(), 700);

  std::map<std::int64_t, SwarmView> seen;
  std::int64_t last_ns = 0;
  for (News news = News::kNothing; news != News::kRunEnded;) {
    news = observer.wait(60s);
    ASSERT_NE(news, News::kNothing);
    if (news != News::kState) continue;
    const SwarmAt& at = *observer.state();
    EXPECT_TRUE(seen.empty() || seen.rbegin()->first <= at.swarm.tick.count());
    EXPECT_GE(at.wall_ns, last_ns);
    EXPECT_NEAR(at.time_s, static_cast<double>(at.swarm.tick.count()) * facts.tick_s, 1e-9);
    last_ns = at.wall_ns;
    seen.insert_or_assign(at.swarm.tick.count(), at.swarm);
  }
  EXPECT_EQ(observer.run(), nullptr);
  ASSERT_EQ(run.wait().status, 0);
  // Four seconds at four times real time are one second: half of the 60 states a second leave room for a busy machine.
  EXPECT_GE(seen.size(), 30u);
  EXPECT_EQ(seen.rbegin()->first, facts.last_tick);

  recorder::Reader reader(scratch / "run/recording.ktrec");
  std::size_t compared = 0;
  while (const proto::StateRecord* state = reader.next_state()) {
    const auto found = seen.find(state->tick());
    if (found == seen.end()) continue;
    ++compared;
    const SwarmView& swarm = found->second;
    for (int robot = 0; robot < 12; ++robot) {
      const auto i = static_cast<std::size_t>(robot);
      EXPECT_EQ(swarm.x_mm[i], state->x_mm(robot));
      EXPECT_EQ(swarm.y_mm[i], state->y_mm(robot));
      EXPECT_EQ(swarm.heading_rad[i], state->heading_rad(robot));
      EXPECT_EQ(swarm.led[i], static_cast<std::uint8_t>(state->led()[i]));
    }
  }
  EXPECT_EQ(compared, seen.size());
}

TEST_F(ObserverTest, OutlivesARunAndFindsTheNext) {
  const test::OwnDomain domain;
  Observer observer({domain.number, {}});
  std::uint64_t first = 0;
  for (const char* out : {"first", "second"}) {
    // A run lasts until it is interrupted: however busy the machine is, the observer finds it.
    test::Words words = run_of(scratch / "observed.txtpb", domain, scratch / out);
    words.insert(words.end(), {"--duration", "3600", "--pace", "1"});
    Process run(words, scratch.path());
    ASSERT_TRUE(await(observer, News::kRunBegan)) << out;
    EXPECT_NE(observer.run()->run, first);
    first = observer.run()->run;
    EXPECT_EQ(observer.state(), nullptr) << "no state of the run before";
    ASSERT_TRUE(await(observer, News::kState)) << out;
    run.signal(SIGINT);
    ASSERT_TRUE(await(observer, News::kRunEnded)) << out;
    EXPECT_NE(run.wait().err.find("interrupted"), std::string::npos);
  }
}

TEST_F(ObserverTest, AStalledObserverChangesNothing) {
  const auto hash_of = [&](const std::string& out) {
    return recorder::read_summary(scratch / (out + "/summary.json")).state_hash;
  };
  const test::OwnDomain domain;
  const std::string experiment = scratch / "observed.txtpb";
  test::Words words = run_of(experiment, domain, scratch / "alone");
  words.insert(words.end(), {"--duration", "200"});
  ASSERT_EQ(Process(words, scratch.path()).wait().status, 0);

  Process probe({KILOTWIN_PROBE, domain.name}, scratch.path());
  words[7] = scratch / "observed";
  Process run(words, scratch.path());
  ASSERT_TRUE(probe.says("sees the run", 60));
  probe.signal(SIGSTOP);
  // 200 simulated seconds are 6100 ticks: far more than any buffer holds, if anything waited for the observer.
  EXPECT_EQ(run.wait().status, 0) << "a run that waits for a stalled observer does not end";
  probe.signal(SIGCONT);
  EXPECT_EQ(hash_of("observed"), hash_of("alone"));
}

}  // namespace
}  // namespace kilotwin::observe
