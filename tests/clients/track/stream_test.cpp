// A TrackerFrame as a reader of another program gets it.
#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <mutex>

#include "clients/cli/vision/tracker_stream.hpp"

namespace kilotwin::cli {
namespace {

TEST(TrackerStreamTest, ReadersGetWhatWasTracked) {
  const dds::DomainClaim claim = dds::DomainClaim::any();
  const dds::Transport here{claim.domain(), {}};
  dds::Participant participant(here);
  std::mutex mutex;
  std::condition_variable arrived;
  int frames = 0;
  dds::Reader<PublicTrackerFrame> reader(participant, topics::tracker_frames(),
                                         [&](const PublicTrackerFrame& frame, dds::SampleState state) {
                                           if (!state.valid) return;
                                           EXPECT_STREQ(frame.source, "overhead");
                                           EXPECT_GE(frame.sent_ns, frame.capture_ns);
                                           ASSERT_EQ(frame.robot._length, 2U);
                                           EXPECT_EQ(frame.robot._buffer[1], 7U);
                                           EXPECT_EQ(frame.state._buffer[0], 0);
                                           EXPECT_EQ(frame.state._buffer[1], 2);
                                           EXPECT_DOUBLE_EQ(frame.x_mm._buffer[0], 12.5);
                                           EXPECT_DOUBLE_EQ(frame.heading_rad._buffer[0], 1.25);
                                           EXPECT_TRUE(std::isinf(frame.heading_variance_rad2._buffer[1]));
                                           EXPECT_EQ(frame.led._buffer[0], 3 << 2);
                                           EXPECT_EQ(frame.led._buffer[1], 255);
                                           const std::lock_guard lock(mutex);
                                           ++frames;
                                           arrived.notify_all();
                                         });
  TrackerStream stream(here, "overhead");
  track::TrackedRobot seen, lost;
  seen.track = 3;
  seen.position = {12.5, -4};
  seen.heading = track::Heading{1.25, 0.01};
  seen.led = track::Led::kGreen;
  lost.track = 7;
  lost.state = track::TrackState::kLost;
  lost.led_known = false;
  std::unique_lock lock(mutex);
  // Samples before reader and writer have found each other are lost.
  for (std::uint64_t frame = 0; frame < 300 && frames < 3; ++frame) {
    lock.unlock();
    stream.publish(frame, 1000, {seen, lost});
    lock.lock();
    arrived.wait_for(lock, std::chrono::milliseconds(100), [&] { return frames >= 3; });
  }
  EXPECT_GE(frames, 3);
}

}  // namespace
}  // namespace kilotwin::cli
