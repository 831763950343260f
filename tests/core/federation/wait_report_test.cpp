#include "core/federation/wait_report.hpp"

#include <gtest/gtest.h>

#include <string>

namespace kilotwin {
namespace {

using namespace std::chrono_literals;

const WaitReport::Clock::time_point kBegan{1h};

/// The reports at each full second of a wait, from 0: '.' none, 'w' the federates, 'c' the federates and the likely cause.
std::string said(WaitReport& report, int from_s, int to_s) {
  std::string text;
  for (int s = from_s; s < to_s; ++s) text += ".wc"[static_cast<int>(report.due(kBegan + s * 1s))];
  return text;
}

TEST(WaitReport, NamesFederatesAfterASecondAndThenEveryFive) {
  WaitReport report(kBegan);
  EXPECT_EQ(said(report, 0, 13), ".w....w....w.");
}

TEST(WaitReport, GivesTheLikelyCauseOnceAfterAMinuteWithoutProgress) {
  WaitReport report(kBegan);
  const std::string text = said(report, 0, 200);
  EXPECT_EQ(text.find('c'), 61u);  // the first line that is due after a minute
  EXPECT_EQ(text.rfind('c'), 61u);
}

TEST(WaitReport, ProgressPutsTheLikelyCauseOff) {
  WaitReport report(kBegan);
  EXPECT_EQ(said(report, 0, 50).find('c'), std::string::npos);
  report.progress(kBegan + 50s);
  EXPECT_EQ(report.waited(kBegan + 52s), 2s);
  EXPECT_EQ(said(report, 50, 200).find('c') + 50, 111u);
}

}  // namespace
}  // namespace kilotwin
