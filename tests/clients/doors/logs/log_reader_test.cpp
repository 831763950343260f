#include "clients/doors/logs/log_reader.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

proto::LogDoor ark(const std::string& more = "") { return settings("log { " + more + " }").log(); }
proto::LogDoor lars(const std::string& more = "") { return settings("log { format: LARS " + more + " }").log(); }
const std::string kHeader = "a\nb\nc\nd\ne\nf\ng\nh\ni\n";

std::vector<LogRow> rows(const std::string& text, const proto::LogDoor& log) {
  LogReader reader(std::make_unique<std::istringstream>(text), "run.log", log);
  std::vector<LogRow> all;
  while (auto row = reader.next()) all.push_back(std::move(*row));
  return all;
}

std::string error_of(const std::string& text, const proto::LogDoor& log) {
  try {
    static_cast<void>(rows(text, log));
    return "";
  } catch (const UserError& error) {
    return error.what();
  }
}

TEST(LogReader, ReadsARowOfArk) {
  const auto all =
      rows("0.5\t7\t1\t1000.5\t200\t90\t8\t0\t3\t4\t-450\r\n\n1\t7\t3\t1\t2\t3\t8\t9\t3\t4\t5\t\n", ark());
  ASSERT_EQ(all.size(), 2u);
  EXPECT_DOUBLE_EQ(all[0].time_s, 0.5);
  ASSERT_EQ(all[0].robots.size(), 2u);
  const LogRobot& first = all[0].robots[0];
  EXPECT_EQ(first.number, 7u);
  EXPECT_DOUBLE_EQ(first.x, 1000.5);
  EXPECT_DOUBLE_EQ(first.y, 200);
  EXPECT_EQ(first.led, 3) << "red";
  EXPECT_NEAR(first.heading_rad.value(), kPi / 2, 1e-12);
  EXPECT_EQ(all[0].robots[1].led, 0);
  EXPECT_NEAR(all[0].robots[1].heading_rad.value(), -kPi / 2, 1e-12) << "-450 degrees";
  EXPECT_EQ(all[1].robots[0].led, 3 << 4) << "blue";
  EXPECT_EQ(all[1].robots[1].led, 255) << "9 is no colour";
}

TEST(LogReader, AStateEndsTheColumnsOfARobotOfArk) {
  const auto all = rows("1\t0\t0\t1\t2\t3\tX1\n", ark("columns: 6 time_unit_s: 0.1"));
  ASSERT_EQ(all.size(), 1u);
  EXPECT_DOUBLE_EQ(all[0].time_s, 0.1);
  EXPECT_EQ(all[0].robots.size(), 1u);
  EXPECT_EQ(rows("1\t0\t0\t1\t2\t3\t4\n", ark()).at(0).robots.size(), 1u) << "the first row tells";
}

TEST(LogReader, ReadsTheLogsOfLars) {
  const auto three = rows(kHeader + "33\t0\t1\t2\t1\t3\t4\n66\t0\t1\t2\t1\tnan\tnan\n", lars("columns: 3"));
  ASSERT_EQ(three.size(), 2u);
  EXPECT_DOUBLE_EQ(three[0].time_s, 0.033);
  EXPECT_FALSE(three[0].robots[1].heading_rad);
  EXPECT_EQ(three[0].robots[1].led, 255);
  EXPECT_TRUE(std::isnan(three[1].robots[1].x));
  const auto four = rows(kHeader + "33\t5\t1\t2\t2\n", lars());
  EXPECT_EQ(four.at(0).robots.at(0).led, 3 << 2) << "green";
  const auto six = rows(kHeader + "33\t5\t1\t2\t2\t0.5\t-1\n", lars("columns: 6"));
  EXPECT_DOUBLE_EQ(six.at(0).robots.at(0).vx.value(), 0.5);
  EXPECT_DOUBLE_EQ(six.at(0).robots.at(0).vy.value(), -1);
}

TEST(LogReader, OneLineForEveryMistake) {
  struct Bad {
    std::string text;
    proto::LogDoor log;
    std::string error;
  };
  const Bad cases[] = {
      {"x\t0\t0\t1\t2\t3\n", ark(), "run.log:1:1: the time is \"x\"; it takes a number"},
      {"1\t0\t0\t1\t2y\t3\n", ark(), "run.log:1:9: y is \"2y\"; it takes a number"},
      {"1\t0\t0\t1\t2\t3\n2\t-1\t0\t1\t2\t3\n", ark(),
       "run.log:2:3: a robot's number is \"-1\"; it takes a whole number, at least 0"},
      {"1\t0\tred\t1\t2\t3\n", ark(), "run.log:1:5: a colour is \"red\"; it takes a whole number, at least 0"},
      {"1\t0\t0\t1\t2\n", ark(),
       "run.log:1:1: the row has 4 columns after the time; it takes 5 or 6 per robot, separated by tabs"},
      {"1\t0\t0\t1\t2\t3\n2\t0\t0\t1\t2\t3\t4\n", ark(),
       "run.log:2:1: the row has 6 columns after the time; it takes 5 per robot, separated by tabs"},
      {"2\t0\t0\t1\t2\t3\n1\t0\t0\t1\t2\t3\n", ark(),
       "run.log:2:1: the time is 1, before the row above; times must not go back"},
      {"inf\t0\t0\t1\t2\t3\n", ark(), "run.log:1:1: the time is not finite; it takes a number"},
      {"1\t0\t0\t1\t2\t3\t0\t0\t1\t2\t3\n", ark(),
       "run.log:1:13: robot 0 is twice in the row; it takes each robot once"},
      {"1\n", ark(), "run.log:1:1: the first row holds a time alone; state columns in the door's log { ... }"},
      {"a\nb\n", lars(),
       "run.log:3:1: the file ends within the header; a log of LARS begins with 9 lines before the first row"},
      {kHeader + "1\t0\t1\t2\t0\t0\t0\n", lars(),
       "run.log:10:1: the row fits 3 and 6 columns per robot; state columns in the door's log { ... }"},
  };
  for (const Bad& bad : cases) EXPECT_EQ(error_of(bad.text, bad.log), bad.error) << bad.text;
}

/// Random logs are read as they were written.
TEST(LogReader, AWrittenLogIsReadAsItWas) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> number(-5000, 5000);
  for (const std::size_t robots : {1u, 7u, 100u}) {
    std::string text;
    std::vector<double> values;
    for (int t = 0; t < 50; ++t) {
      text += fmt::format("{}", 0.1 * t);
      for (std::size_t i = 0; i < robots; ++i) {
        const double x = number(random), y = number(random), orientation = number(random) / 50;
        values.insert(values.end(), {x, y, orientation});
        text += fmt::format("\t{}\t{}\t{}\t{}\t{}", i, random() % 4, x, y, orientation);
      }
      text += "\n";
    }
    const auto all = rows(text, ark("columns: 5"));
    ASSERT_EQ(all.size(), 50u);
    std::size_t at = 0;
    for (const LogRow& row : all) {
      ASSERT_EQ(row.robots.size(), robots);
      for (const LogRobot& robot : row.robots) {
        EXPECT_EQ(robot.x, values[at]);
        EXPECT_EQ(robot.y, values[at + 1]);
        EXPECT_NEAR(robot.heading_rad.value(), values[at + 2] * kPi / 180, 1e-9);
        at += 3;
      }
    }
  }
}

/// Every log is read, or refused with a place.
TEST(LogReader, RandomAndMutatedLogsAreReadOrRefused) {
  std::mt19937_64 random(11);
  const std::string good = kHeader + "33\t0\t1.5\t2\t1\t0.1\t0.2\n66\t0\t1.7\t2\t1\t0.1\t0.2\n";
  const std::string alphabet = "0123456789\t\n\r-+.eEnaifx \xff";
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = good;
    if (i % 4 == 0) {
      text.resize(random() % 200);
      for (char& c : text) c = alphabet[random() % alphabet.size()];
    } else {
      for (std::size_t changes = 1 + random() % 5; changes > 0; --changes) {
        const std::size_t at = random() % text.size();
        switch (random() % 3) {
          case 0: text[at] = alphabet[random() % alphabet.size()]; break;
          case 1: text.erase(at, 1 + random() % 3); break;
          default: text.insert(at, 1, alphabet[random() % alphabet.size()]); break;
        }
        if (text.empty()) text = "1";
      }
    }
    const std::string error = error_of(text, i % 2 == 0 ? lars(i % 8 == 0 ? "" : "columns: 6") : ark());
    if (error.empty()) continue;
    ++refused;
    EXPECT_TRUE(error.starts_with("run.log:")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace kilotwin::doors::test
