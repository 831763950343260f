// Messages for users: plain on a terminal, with a time stamp in a service's log.
#include "core/base/say.hpp"

#include <gtest/gtest.h>

namespace kilotwin {
namespace {

TEST(Say, ErrorTextIsReadFromALog) {
  EXPECT_EQ(error_text("[2026-11-22T21:30:12.123Z] [physics 0,0] [error] the disk is full"), "the disk is full");
  EXPECT_EQ(error_text("[2026-11-22T21:30:12.123Z] [physics 0,0] [info] starts"), "");
  EXPECT_EQ(error_text("the disk is full"), "the disk is full");
  EXPECT_EQ(error_text("[0] is no stamp"), "[0] is no stamp");
}

TEST(Say, LinesArePlainUntilLogAs) {
  testing::internal::CaptureStderr();
  say("kilotwin: interrupted");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "kilotwin: interrupted\n");
  testing::internal::CaptureStderr();
  log_as("physics 0,0");
  say_error("kilotwin: the disk is full");
  const std::string line = testing::internal::GetCapturedStderr();
  EXPECT_NE(line.find("Z] [physics 0,0] [error] the disk is full\n"), std::string::npos) << line;
  EXPECT_EQ(error_text(line), "the disk is full\n");
}

}  // namespace
}  // namespace kilotwin
