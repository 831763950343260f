// Frames, requests and descriptions: what crosses to viewers.
#include "clients/view/frame_code.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "clients/view/request.hpp"
#include "clients/view/run_text.hpp"
#include "core/base/pose.hpp"
#include "idl/experiment.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin::view {
namespace {

template <class Value> Value at(const std::string& frame, std::size_t offset) {
  Value value;
  std::memcpy(&value, frame.data() + offset, sizeof value);
  return value;
}

TEST(FrameCode, RoundsPositionsToTheGridAndHeadingsTo1024thsOfATurn) {
  constexpr std::size_t kRobots = 500;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-1000, 1000), angle(-kPi, kPi);
  std::vector<double> x(kRobots), y(kRobots), heading(kRobots);
  std::vector<std::uint8_t> led(kRobots), life(kRobots), left(kRobots), right(kRobots);
  constexpr std::array<std::uint8_t, 4> kLives{4, 253, 254, 255};
  for (std::size_t i = 0; i < kRobots; ++i) {
    x[i] = place(random);
    y[i] = place(random);
    heading[i] = angle(random);
    led[i] = static_cast<std::uint8_t>(i % 64);
    life[i] = kLives[i % 4];
    left[i] = i % 2 ? 200 : 0;
    right[i] = i % 3 ? 1 : 0;
  }
  const std::vector<double> mx{1.5}, my{-2.5}, mh{0.25};
  const PositionGrid grid = PositionGrid::over(1000, 500);
  const std::string frame = encode_frame({9, 77, 78}, {x, y, heading, led, life, left, right, mx, my, mh}, grid);
  ASSERT_EQ(frame.size(), kFrameHeader_bytes + kFrameMovable_bytes + kRobots * kFrameRobot_bytes);
  EXPECT_EQ(at<std::uint32_t>(frame, 0), kFrameMagic);
  EXPECT_EQ(at<std::uint32_t>(frame, 4), 9u);
  EXPECT_EQ(at<double>(frame, 8), 77);
  EXPECT_EQ(at<double>(frame, 16), 78);
  EXPECT_EQ(at<float>(frame, 36), -2.5f);
  const std::size_t columns = kFrameHeader_bytes + kFrameMovable_bytes;
  for (std::size_t i = 0; i < kRobots; ++i) {
    const auto position = [&](std::size_t column) {
      return grid.lowest_mm + grid.step_mm * at<std::uint16_t>(frame, columns + 2 * (column * kRobots + i));
    };
    EXPECT_LE(std::abs(position(0) - x[i]), grid.step_mm / 2 * 1.000001);
    EXPECT_LE(std::abs(position(1) - y[i]), grid.step_mm / 2 * 1.000001);
    const auto value = at<std::uint16_t>(frame, columns + 2 * (2 * kRobots + i));
    EXPECT_EQ(value & 63, led[i]);
    EXPECT_LE(std::abs(wrapped((value >> 6) * 2 * kPi / 1024 - heading[i])), kPi / 1024 * 1.000001);
    const auto state = at<std::uint8_t>(frame, columns + 6 * kRobots + i);
    EXPECT_EQ(state & 15, life[i] & 15);
    EXPECT_EQ((state & 16) != 0, left[i] > 0);
    EXPECT_EQ((state & 32) != 0, right[i] > 0);
  }
}

TEST(FrameCode, MovesPositionsBeyondTheGridToItsEdge) {
  const PositionGrid grid = PositionGrid::over(100, 200);
  EXPECT_EQ(grid.at(-1e7), 0);
  EXPECT_EQ(grid.at(1e7), 65535);
  EXPECT_NEAR(grid.lowest_mm + grid.step_mm * grid.at(0), 0, grid.step_mm);
}

TEST(ViewRequest, ReadsEveryKind) {
  EXPECT_EQ(parse_request(R"({"do":"hello","token":"abc"})")->token, "abc");
  EXPECT_EQ(parse_request(R"({"do":"next"})")->kind, Request::Kind::kNext);
  const auto seek = parse_request(R"({"do":"at","tick":12345678901,"request":7})");
  ASSERT_TRUE(seek);
  EXPECT_EQ(seek->tick, 12345678901);
  EXPECT_EQ(seek->number, 7u);
  EXPECT_EQ(parse_request(R"({"do":"trail","robot":3,"tick":0})")->robot, 3u);
  EXPECT_EQ(parse_request(R"({"do":"robot","robot":4294967295,"tick":0})")->robot, 4294967295u);
  EXPECT_EQ(parse_request(R"({"do":"step","steps":20})")->steps, 20u);
  for (const char* word : {"pause", "continue", "stop"})
    EXPECT_TRUE(parse_request(std::string(R"({"do":")") + word + "\"}")->steers());
}

TEST(ViewRequest, RefusesWhatIsNone) {
  for (const char* text : {"",
                           "[]",
                           "7",
                           "{",
                           "{}",
                           R"({"do":7})",
                           R"({"do":"dance"})",
                           R"({"do":"hello"})",
                           R"({"do":"hello","token":1})",
                           R"({"do":"at","tick":-1,"request":1})",
                           R"({"do":"at","tick":1.5,"request":1})",
                           R"({"do":"at","tick":1})",
                           R"({"do":"at","tick":18446744073709551615,"request":1})",
                           R"({"do":"at","tick":1,"request":0})",
                           R"({"do":"robot","robot":4294967296,"tick":0})",
                           R"({"do":"robot","robot":-1,"tick":0})",
                           R"({"do":"robot","robot":1})",
                           R"({"do":"floors"})",
                           R"({"do":"step","steps":0})",
                           R"({"do":"step","steps":1000001})",
                           R"({"do":"step"})"})
    EXPECT_FALSE(parse_request(text)) << text;
  EXPECT_FALSE(parse_request(R"({"do":"hello","token":")" + std::string(kLongestRequest_bytes, 'a') + "\"}"));
  EXPECT_FALSE(parse_request(std::string(kLongestRequest_bytes, '[')));
}

TEST(ViewRequest, SurvivesAnyBytes) {
  std::mt19937 random(11);
  const std::string seed = R"({"do":"at","tick":120,"request":7,"token":"x"})";
  std::size_t read = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string text = seed;
    for (unsigned changes = random() % 4; changes > 0; --changes)
      text[random() % text.size()] = static_cast<char>(random());
    text.resize(random() % 3 ? text.size() : random() % text.size());
    const auto request = parse_request(text);
    if (!request) continue;
    ++read;
    EXPECT_GE(request->tick, 0);
    EXPECT_LE(request->steps, kMostSteps);
  }
  EXPECT_GT(read, 1000u) << "changed so much that hardly any request was left";
}

TEST(RunText, IsValidJsonWhateverNamesHold) {
  proto::Experiment experiment;
  experiment.add_robots()->set_count(5);
  experiment.mutable_robots(0)->add_behaviour("</script><img src=x onerror=alert(1)>\xff\xfe\".c");
  experiment.add_robots()->set_count(2);
  experiment.mutable_robots(1)->set_body(proto::RobotGroup::TRACKED);
  experiment.mutable_arena()->mutable_circle()->set_radius_mm(300);
  RunOutline outline;
  outline.name = "\"}\xc3\x28</title>";
  outline.seed = 18446744073709551615u;
  outline.robots = 7;
  const nlohmann::json text = nlohmann::json::parse(run_text(outline, experiment));
  EXPECT_EQ(text["type"], "run");
  EXPECT_EQ(text["seed"], "18446744073709551615");
  EXPECT_EQ(text["arena"]["radius"], 300);
  EXPECT_EQ(text["groups"][1]["kind"], "tracked");
  EXPECT_EQ(text["groups"][1]["first"], 5);
  EXPECT_EQ(nlohmann::json::parse(notice_text("a\"b\n"))["text"], "a\"b\n");
}

TEST(RunText, FloorsAreBase64) {
  proto::FloorRecord floor;
  floor.set_columns(1);
  floor.set_rows(1);
  floor.set_rgba("\x01\x02\x03\xff");
  floor.add_circle_name("food");
  for (const double value : {1.0, 2.0, 3.0}) floor.add_circle_mm(value);
  floor.set_circle_rgba(std::string("\0\0\0\x80", 4));
  const nlohmann::json text = nlohmann::json::parse(floors_text({floor}));
  EXPECT_EQ(text["floors"][0]["rgba"], "AQID/w==");
  EXPECT_EQ(text["floors"][0]["circles"][0]["rgba"], "AAAAgA==");
  EXPECT_EQ(text["floors"][0]["circles"][0]["y"], 2);
}

}  // namespace
}  // namespace kilotwin::view
