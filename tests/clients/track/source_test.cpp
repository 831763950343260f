// Sources of pictures: order, ARK's names, directories that grow, what live sources drop.
#include "clients/track/source.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fmt/format.h>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "clients/track/capture_clock.hpp"
#include "core/base/error.hpp"

namespace kilotwin::track {
namespace {

namespace fs = std::filesystem;

class Sources : public testing::Test {
 protected:
  void SetUp() override {
    directory_ = fs::temp_directory_path() / fmt::format("kilotwin-source-{}", getpid());
    fs::remove_all(directory_);
    fs::create_directories(directory_);
  }
  void TearDown() override { fs::remove_all(directory_); }
  /// A picture whose grey level says which one it is; renamed into place, as writers of growing directories do.
  void write(const std::string& name, int level) const {
    const fs::path scratch = directory_ / ("." + name + ".tmp.png");
    cv::imwrite(scratch.string(), cv::Mat(8, 8, CV_8UC3, cv::Scalar(level, level, level)));
    fs::rename(scratch, directory_ / name);
  }
  [[nodiscard]] static int level(const CapturedFrame& frame) { return frame.picture.at<cv::Vec3b>(4, 4)[0]; }

  fs::path directory_;
  std::atomic<bool> stop_{false};
};

TEST_F(Sources, ADirectoryComesInTheOrderOfNames) {
  write("b.png", 20);
  write("a.png", 10);
  write("c.png", 30);
  const auto source = open_source(directory_.string(), {.rate_hz = 10});
  EXPECT_FALSE(source->live());
  for (int i = 0; i < 3; ++i) {
    const auto frame = source->next(stop_);
    ASSERT_TRUE(frame);
    EXPECT_EQ(level(*frame), 10 * (i + 1));
    EXPECT_NEAR(frame->time_s, 0.1 * i, 1e-12);
    EXPECT_EQ(frame->number, static_cast<std::uint64_t>(i));
  }
  EXPECT_FALSE(source->next(stop_));
}

TEST_F(Sources, OneCameraOfAnArkDirectory) {
  for (int frame = 0; frame < 2; ++frame) {
    for (int camera = 0; camera < 4; ++camera)
      write(fmt::format("frame_{:05}_{}.jpg", frame, camera), 50 * camera + frame);
  }
  const auto source = open_source(directory_.string(), {.camera = 2});
  EXPECT_EQ(level(*source->next(stop_)), 100);
  EXPECT_EQ(level(*source->next(stop_)), 101);
  EXPECT_FALSE(source->next(stop_));
}

TEST_F(Sources, AGrowingDirectoryIsFollowedAndDropsAreCounted) {
  write("00.png", 5);
  FrameQueue frames(open_source(directory_.string(), {.watch = true}));
  const auto first = frames.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(level(*first), 5);
  EXPECT_GT(first->capture_ns, 0);
  constexpr int kMore = 12;
  for (int i = 1; i <= kMore; ++i) write(fmt::format("{:02}.png", i), 5 + i);
  // The newest arrives; what came between may be dropped, and is then counted.
  std::uint64_t taken = 1;
  for (int last = 5; last != 5 + kMore;) {
    const auto frame = frames.next();
    ASSERT_TRUE(frame);
    EXPECT_GT(level(*frame), last);
    last = level(*frame);
    ++taken;
  }
  EXPECT_EQ(taken + frames.dropped(), 1U + kMore);
  frames.stop();
  EXPECT_FALSE(frames.next());
}

/// Speeds follow from the simulated time that pictures of `kilotwin cameras` tell, whatever the pace of the run.
TEST(CaptureClocks, FollowTheTimeOfWhatPicturesShow) {
  CaptureClock clock;
  const auto time_of = [&](const std::optional<cameras::FrameStamp>& stamp) {
    CapturedFrame frame;
    clock.time(frame, stamp);
    return frame.time_s;
  };
  cameras::FrameStamp stamp;
  stamp.run = 7;
  stamp.simulated_s = 100;
  EXPECT_EQ(time_of(stamp), 0);
  stamp.simulated_s = 102.5;
  EXPECT_EQ(time_of(stamp), 2.5);
  EXPECT_EQ(time_of(stamp), 2.5) << "the run stands still";
  // Another run, and pictures without a stamp: time goes on as it came.
  stamp.run = 8;
  stamp.simulated_s = 1;
  const double later_s = time_of(stamp);
  EXPECT_GE(later_s, 2.5);
  EXPECT_LT(later_s, 60);
  stamp.simulated_s = 2;
  EXPECT_DOUBLE_EQ(time_of(stamp), later_s + 1);
  EXPECT_GE(time_of(std::nullopt), later_s + 1);
}

TEST_F(Sources, FilesAreNotDropped) {
  constexpr int kCount = 20;
  for (int i = 0; i < kCount; ++i) write(fmt::format("{:02}.png", i), 10 + i);
  FrameQueue frames(open_source(directory_.string(), {}));
  int count = 0;
  while (frames.next()) ++count;
  EXPECT_EQ(count, kCount);
  EXPECT_EQ(frames.dropped(), 0U);
}

TEST_F(Sources, WhatCannotBeReadIsSaid) {
  EXPECT_THROW(static_cast<void>(open_source((directory_ / "none.png").string(), {})), UserError);
  EXPECT_THROW(static_cast<void>(open_source(directory_.string(), {})), UserError);
  std::ofstream(directory_ / "broken.png") << "no picture";
  FrameQueue frames(open_source((directory_ / "broken.png").string(), {}));
  EXPECT_THROW(static_cast<void>(frames.next()), UserError);
}

}  // namespace
}  // namespace kilotwin::track
