// Recordings by their index: every state is found, whatever grows, is cut off or damaged.
#include "clients/view/recorded_run.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/base/error.hpp"
#include "tests/clients/view/recordings.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::view {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using recorder::StateIndex;
using test::Scratch;

double tick_of(const std::string& frame) {
  double tick = -1;
  std::memcpy(&tick, frame.data() + 8, sizeof tick);
  return tick;
}

TEST(StateIndex, FindsTheStatesThatTheReaderReads) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 30, .states = 200, .floors = true});
  StateIndex index(scratch / "r.ktrec");
  EXPECT_TRUE(index.update());
  EXPECT_FALSE(index.update()) << "nothing new";
  EXPECT_TRUE(index.ended());
  EXPECT_EQ(index.floors().size(), 2u);
  recorder::Reader sequential(scratch / "r.ktrec"), random(scratch / "r.ktrec");
  std::size_t number = 0;
  while (const proto::StateRecord* state = sequential.next_state()) {
    ASSERT_LT(number, index.states().size());
    EXPECT_EQ(index.states()[number].tick, state->tick());
    ++number;
  }
  EXPECT_EQ(number, index.states().size());
  // Backwards, so that no state follows the one before.
  for (std::size_t i = number; i-- > 0;) {
    random.go_to(index.states()[i].offset);
    const proto::Record* const record = random.next();
    ASSERT_TRUE(record != nullptr && record->has_state());
    EXPECT_EQ(record->state().tick(), index.states()[i].tick);
    EXPECT_EQ(index.at_or_before(index.states()[i].tick), i);
    if (i > 0) {
      EXPECT_EQ(index.at_or_before(index.states()[i].tick - 1), i - 1);
    }
  }
  EXPECT_EQ(index.at_or_before(-5), 0u);
  EXPECT_EQ(index.at_or_before(1 << 30), number - 1);
}

TEST(StateIndex, StopsAtEveryCutAndGoesOnWhenTheFileGrows) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 12});
  const std::string whole = test::read(scratch / "whole.ktrec");
  StateIndex all(scratch / "whole.ktrec");
  all.update();
  test::write(scratch / "r.ktrec", "");
  StateIndex growing(scratch / "r.ktrec");
  std::ofstream out(scratch / "r.ktrec", std::ios::binary);
  std::size_t known = 0;
  for (std::size_t at = 0; at < whole.size(); at += 17) {
    out.write(whole.data() + at, static_cast<std::streamsize>(std::min<std::size_t>(17, whole.size() - at)));
    out.flush();
    growing.update();
    ASSERT_GE(growing.states().size(), known);
    known = growing.states().size();
  }
  EXPECT_EQ(known, all.states().size());
  EXPECT_TRUE(growing.ended());
}

TEST(StateIndex, SurvivesDamageAnywhere) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 12});
  const std::string whole = test::read(scratch / "whole.ktrec");
  for (std::size_t at = 0; at < whole.size(); at += 17) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    test::write(scratch / "r.ktrec", damaged);
    StateIndex index(scratch / "r.ktrec");
    index.update();
    ASSERT_LE(index.states().size(), 12u);
    try {
      RecordedRun run(scratch / "r.ktrec");
      for (const std::int64_t tick : {0, 60, 100000}) {
        const std::string frame = run.frame_at(tick, 1);
        EXPECT_TRUE(frame.empty() || frame.size() == kFrameHeader_bytes + 3 * kFrameRobot_bytes);
      }
      static_cast<void>(run.trail(2, 100));
    } catch (const UserError&) {
      // The header, or the first state, is damaged.
    }
  }
}

TEST(RecordedRun, GivesTheStateAtAnyTime) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 50});
  RecordedRun run(scratch / "r.ktrec");
  const json text = json::parse(run.text());
  EXPECT_EQ(text["source"], "recorded");
  EXPECT_EQ(text["states"], 50);
  EXPECT_EQ(text["robots"], 20);
  const auto last = text["lastTick"].get<std::int64_t>();
  for (std::int64_t tick = last + 3; tick >= 0; tick -= 7) {
    const std::string frame = run.frame_at(tick, 4);
    const double at = tick_of(frame);
    EXPECT_LE(at, static_cast<double>(tick));
    double next = 0;
    std::memcpy(&next, frame.data() + 16, sizeof next);
    EXPECT_TRUE(next > static_cast<double>(tick) || next == at) << tick;
    // The pose, to the grid.
    std::uint16_t x = 0;
    std::memcpy(&x, frame.data() + kFrameHeader_bytes + 2 * 5, sizeof x);
    const double wanted = test::circling_pose(5, 20, at * text["tickSeconds"].get<double>()).x_mm;
    EXPECT_NEAR(text["gridLowest"].get<double>() + text["gridStep"].get<double>() * x, wanted, 0.02);
  }
}

TEST(RecordedRun, TellsOfRobotsAndTheirTrails) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 2000, .every_s = 0.1});
  RecordedRun run(scratch / "r.ktrec");
  const json robot = json::parse(run.robot(1));
  EXPECT_EQ(robot["radio"]["attempted"], 6);
  EXPECT_EQ(robot["heard"][0]["robot"], 0);
  EXPECT_EQ(robot["heard"][0]["count"], 9);
  EXPECT_EQ(robot["heard"].size(), 2u);
  EXPECT_EQ(robot["heardBy"][0]["robot"], 0);
  EXPECT_EQ(json::parse(run.robot(20))["type"], "notice");
  const json trail = json::parse(run.trail(3, 1000));
  EXPECT_LE(trail["xy"].size(), 800u);
  EXPECT_GT(trail["xy"].size(), 200u);
  const Pose end = test::circling_pose(3, 20, 1000 * 0.032768);
  EXPECT_NEAR(trail["xy"][trail["xy"].size() - 2].get<double>(), end.x_mm, 1);
  EXPECT_EQ(json::parse(run.trail(20, 0))["type"], "notice");
  EXPECT_NE(run.steer({}), "");
}

TEST(RecordedRun, ChangesTheFloorWithTime) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 2, .states = 40, .floors = true});
  RecordedRun run(scratch / "r.ktrec");
  EXPECT_EQ(run.floors_version(0), 1u);
  EXPECT_EQ(run.floors_version(100000), 2u);
  const json first = json::parse(run.floors_at(0)), last = json::parse(run.floors_at(100000));
  EXPECT_EQ(first["floors"].size(), 1u);
  EXPECT_EQ(last["floors"].size(), 1u);
  EXPECT_NE(first["floors"][0]["rgba"], last["floors"][0]["rgba"]);
}

TEST(RecordedRun, RefusesWhatIsNoRun) {
  Scratch scratch;
  EXPECT_THROW(RecordedRun(scratch / "nowhere"), UserError);
  test::write(scratch / "r.ktrec", "something else");
  EXPECT_THROW(RecordedRun(scratch / "r.ktrec"), UserError);
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 1});
  test::write(scratch / "begun.ktrec", test::read(scratch / "whole.ktrec").substr(0, 100));
  EXPECT_THROW(RecordedRun(scratch / "begun.ktrec"), UserError);
}

}  // namespace
}  // namespace kilotwin::view
