#include "core/federation/snapshots.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include "core/federation/checkpoint.hpp"

namespace kilotwin {
namespace {

namespace fs = std::filesystem;
using Clock = Snapshots::Clock;

TEST(Snapshots, AreDueOnceAMinute) {
  Snapshots snapshots("/nowhere", true), unwanted("/nowhere", false);
  const Clock::time_point begin{std::chrono::hours(5)};
  int taken = 0;
  for (int s = 0; s < 600; ++s) {
    if (snapshots.due(begin + std::chrono::seconds(s))) ++taken;
    EXPECT_FALSE(unwanted.due(begin + std::chrono::seconds(s)));
  }
  EXPECT_EQ(taken, 9);
}

TEST(Snapshots, KeepTheLastTwoAndNoOtherCheckpointIsRemoved) {
  std::string run = (fs::temp_directory_path() / "snapshots-XXXXXX").string();
  ASSERT_NE(mkdtemp(run.data()), nullptr);
  const auto there = [&](std::int64_t tick) { return fs::exists(checkpoint_directory(run, Tick{tick})); };
  Snapshots snapshots(run, true);
  for (const std::int64_t tick : {100, 200, 300}) {
    fs::create_directories(checkpoint_directory(run, Tick{tick}));
    snapshots.taken(Tick{tick});
  }
  EXPECT_FALSE(there(100));
  EXPECT_TRUE(there(200) && there(300));
  fs::create_directories(checkpoint_directory(run, Tick{250}));  // by a directive
  snapshots.remove_all();
  EXPECT_FALSE(there(200) || there(300));
  EXPECT_TRUE(there(250));
  fs::remove_all(run);
}

}  // namespace
}  // namespace kilotwin
