// The bridge within a domain: what a run and its station would see and say.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "clients/ark-bridge/bridge.hpp"
#include "services/ark/ark_message.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors::test {
namespace {

TEST(ArkBridgeDds, FramesGoInAndOrdersComeOut) {
  const dds::DomainClaim claim = dds::DomainClaim::any();
  const dds::Transport transport{claim.domain(), {}};
  const dds::Participant run(transport);
  std::mutex mutex;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> frames;  // frame, robots
  std::vector<float> speeds;                                    // along x, of the first robot
  const dds::Reader<PublicTrackerFrame> reader(run, topics::tracker_frames(),
                                               [&](const PublicTrackerFrame& sample, dds::SampleState state) {
                                                 if (!state.valid) return;
                                                 const std::lock_guard lock(mutex);
                                                 frames.emplace_back(sample.frame, sample.robot._length);
                                                 if (sample.vx_mm_s._length == sample.robot._length)
                                                   speeds.push_back(sample.vx_mm_s._buffer[0]);
                                               });
  dds::Writer<PublicStationPacket> station(run, topics::station_packets());
  ArkBridge bridge(door("name: 'ark' ark { frame_rate_hz: 10 }", 4), transport);
  const std::vector<ArkRobot> robots{{0, 1, 1, 0.5, 0, 0}, {1, 5, 5, 0, 0, 0}};
  PublicStationPacket packet{};
  packet.command = kRepeatCommand;
  const IrMessage message = ark::pack(std::vector<ark::ArkMessage>{{3, 7, 99}});
  std::copy_n(message.begin(), sizeof packet.message, std::begin(packet.message));
  std::vector<ArkOrder> orders;
  for (int round = 0; round < 500; ++round) {
    station.write(packet);
    bridge.publish(robots, 1000 + round);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (const ArkOrder& order : bridge.take()) orders.push_back(order);
    const std::lock_guard lock(mutex);
    if (frames.size() > 2 && orders.size() > 2) break;
  }
  ASSERT_GT(orders.size(), 2u);
  for (const ArkOrder& order : orders) EXPECT_EQ(std::get<ArkSignal>(order), (ArkSignal{3, 7, 99}));
  EXPECT_TRUE(bridge.joined());
  const std::lock_guard lock(mutex);
  ASSERT_GT(frames.size(), 2u);
  for (const auto& [frame, count] : frames) EXPECT_EQ(count, 2u);
  EXPECT_EQ(speeds, std::vector<float>(frames.size(), 5));
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].first, frames[i - 1].first);
}

}  // namespace
}  // namespace kilotwin::doors::test
