// Unusual programs that check themselves: a red LED means success. They run for 60 s on 50 robots that hear each other.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

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

INSTANTIATE_TEST_SUITE_P(Odd, Corpus, testing::ValuesIn(programs()), [](const auto& tested) {
  std::string name = tested.param.parent_path().filename().string() + "_" + tested.param.stem().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !isalnum(c); }, '_');
  return name;
});

}  // namespace
}  // namespace kilotwin::behaviours::test
