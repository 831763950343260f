// Unusual programs that check themselves: a red LED means success. They run for 60 s on 50 robots that hear each other.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

std::string name_of(const testing::TestParamInfo<fs::path>& tested) {
  std::string name = tested.param.parent_path().filename().string() + "_" + tested.param.stem().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !isalnum(c); }, '_');
  return name;
}

std::vector<fs::path> programs() {
  std::vector<fs::path> result{fs::path(KILOTWIN_CORPUS) / "two_files/main.c"};
  for (const auto& entry : fs::directory_iterator(KILOTWIN_CORPUS)) {
    const std::string extension = entry.path().extension();
    if (extension == ".c" || extension == ".cpp") result.push_back(entry.path());
  }
  std::sort(result.begin(), result.end());
  return result;
}

class Corpus : public testing::TestWithParam<fs::path> {};

TEST_P(Corpus, BuildsAndRuns) {
  constexpr std::uint32_t kRobots = 50;
  constexpr int kTicks = 1832;
  Swarm swarm({GetParam().string()}, kRobots);
  swarm.start();
  for (int tick = 0; tick < kTicks; ++tick) swarm.step(tick < 100 ? echo(swarm.frame()) : Air{});
  const ActuationFrame frame = swarm.frame();
  for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
    EXPECT_EQ(LifeCycle{frame.life_cycle[robot]}, LifeCycle::kRunning) << "robot " << robot;
    EXPECT_EQ(frame.led[robot], kRed) << "robot " << robot;
  }
  for (const auto& host : swarm.hosts) EXPECT_EQ(host->robots_failed(), 0u);
}

// The engine trusts a program's count of writes in place of a comparison of states. Swarm::step() compares all the same.
class ComparedCall : public testing::TestWithParam<fs::path> {};

void as_on_robot(proto::Manifest& manifest) {
  manifest.mutable_experiment()->mutable_robots(0)->set_loop_rate(proto::RobotGroup::AS_ON_ROBOT);
}

TEST_P(ComparedCall, ChangesMemoryOnlyIfItCountsAWrite) {
  constexpr int kTicks = 640;
  Swarm swarm({GetParam().string()}, 20, 1, "", as_on_robot);
  swarm.start();
  for (int tick = 0; tick < kTicks; ++tick) swarm.step(echo(swarm.frame()));
}

std::vector<fs::path> ready_made_programs() {
  std::vector<fs::path> result;
  for (const auto& entry : fs::directory_iterator(KILOTWIN_BEHAVIOURS))
    if (entry.path().extension() == ".c") result.push_back(entry.path());
  std::sort(result.begin(), result.end());
  return result;
}

TEST(ComparedCalls, AreComparedWhereAProgramSaysThatItWroteNothing) {
  Swarm swarm({ready_made("disperse.c")}, 20, 1, "", as_on_robot);
  swarm.start();
  for (int tick = 0; tick < 100; ++tick) swarm.step(echo(swarm.frame()));
  EXPECT_GT(swarm.hosts.front()->unchanged_calls().compared, 1000u);
}

INSTANTIATE_TEST_SUITE_P(Odd, Corpus, testing::ValuesIn(programs()), name_of);
INSTANTIATE_TEST_SUITE_P(Odd, ComparedCall, testing::ValuesIn(programs()), name_of);
INSTANTIATE_TEST_SUITE_P(ReadyMade, ComparedCall, testing::ValuesIn(ready_made_programs()), name_of);

}  // namespace
}  // namespace kilotwin::behaviours::test
