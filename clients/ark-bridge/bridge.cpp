#include "clients/ark-bridge/bridge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "services/ark/ark_message.hpp"

namespace kilotwin::doors {
namespace {

constexpr std::uint8_t kPackedType = 0, kLastBroadcastType = 127;
/// Codes of colours: off, red, green, blue.
constexpr std::array<std::uint8_t, 4> kLed{0, 3, 3 << 2, 3 << 4};
/// ARK's velocity is the difference of two means of two positions, over six frames: with 1 px of noise, its deviation is 0.17 px
/// per frame. Below this speed it tells no direction.
constexpr double kLeastSpeed_px = 0.2;
/// The velocity of a robot that ARK has not seen moving.
constexpr double kNoVelocity_px = 1;
/// ARK sends 60 messages a second; what is older than a minute is of no use.
constexpr std::size_t kMostOrders = 3600;

bool has_velocity(const ArkRobot& robot) {
  const bool initial = robot.vx_px == kNoVelocity_px && robot.vy_px == kNoVelocity_px;
  return std::isfinite(robot.vx_px) && std::isfinite(robot.vy_px) && !initial;
}

bool tells_direction(const ArkRobot& robot) { return std::hypot(robot.vx_px, robot.vy_px) >= kLeastSpeed_px; }

void place_motion(const ArkRobot& robot, const Door& door, TrackedRobot& out) {
  if (!has_velocity(robot)) return;
  if (tells_direction(robot))
    door.placement.place_heading(door.placement.heading_of(robot.vx_px, robot.vy_px), out);
  const proto::ArkDoor& ark = door.settings.ark();
  if (!ark.has_frame_rate_hz()) return;
  door.placement.place_velocity(robot.vx_px * ark.frame_rate_hz(), robot.vy_px * ark.frame_rate_hz(), out);
}

}  // namespace

std::vector<ArkOrder> orders_of(std::uint8_t command, std::span<const std::uint8_t, 10> message,
                                const RobotNames& names, Tally& tally) {
  if (command == kStopCommand) return {ArkStop{}};
  const std::uint8_t type = message[9];
  if (command != kRepeatCommand && command != kOnceCommand) {
    tally.left_out("packets that an experiment of ARK cannot send", fmt::format("command {}", command));
    return {};
  }
  if (type > kLastBroadcastType) {
    tally.left_out("packets that an experiment of ARK cannot send", fmt::format("type {}", type));
    return {};
  }
  if (type != kPackedType) {
    ArkBroadcast broadcast;
    broadcast.type = type;
    std::copy_n(message.begin(), broadcast.data.size(), broadcast.data.begin());
    return {broadcast};
  }
  IrMessage packed{};
  std::copy(message.begin(), message.end(), packed.begin());
  std::vector<ArkOrder> orders;
  for (const ark::ArkMessage& each : ark::unpack(packed)) {
    if (each.id == ark::kArkNobody) continue;
    const auto id = names.number_of(each.id);
    if (id && *id < ark::kArkNobody)
      orders.emplace_back(ArkSignal{static_cast<std::uint16_t>(*id), each.type, each.payload});
  }
  return orders;
}

std::vector<TrackedRobot> tracked_of(std::span<const ArkRobot> robots, const Door& door, Tally& tally) {
  std::vector<TrackedRobot> all;
  for (const ArkRobot& robot : robots) {
    const auto id = door.names.of_number(robot.id);
    if (!id) {
      tally.left_out("poses that belong to no tracked robot", fmt::format("id {}", robot.id));
      continue;
    }
    TrackedRobot out;
    out.robot = *id;
    if (door.placement.place_point(robot.x_px, robot.y_px, out) != Fault::kNone) {
      tally.left_out("poses that are not finite", fmt::format("id {}", robot.id));
      continue;
    }
    place_motion(robot, door, out);
    const auto colour = static_cast<std::size_t>(robot.colour);
    if (colour < kLed.size()) out.led = kLed[colour];
    all.push_back(out);
  }
  const auto by_robot = [](const TrackedRobot& a, const TrackedRobot& b) { return a.robot < b.robot; };
  std::stable_sort(all.begin(), all.end(), by_robot);
  const auto same = [](const TrackedRobot& a, const TrackedRobot& b) { return a.robot == b.robot; };
  const auto twice = std::unique(all.begin(), all.end(), same);
  for (auto each = twice; each != all.end(); ++each)
    tally.left_out("poses of a robot that the frame has already", fmt::format("robot {}", each->robot));
  all.erase(twice, all.end());
  return all;
}

ArkBridge::ArkBridge(Door door, const dds::Transport& run)
    : door_(std::move(door)), participant_(run), writer_(participant_, door_.settings.name()) {
  if (!door_.settings.ark().messages()) return;
  packets_ = std::make_unique<dds::Reader<PublicStationPacket>>(
      participant_, topics::station_packets(), [this](const PublicStationPacket& packet, dds::SampleState state) {
        if (state.valid) on_packet(packet);
      });
}

ArkBridge::~ArkBridge() = default;

void ArkBridge::publish(std::span<const ArkRobot> robots, std::int64_t captured_ns) {
  TrackedFrame frame;
  {
    const std::lock_guard lock(mutex_);
    frame.robots = tracked_of(robots, door_, tally_);
    tally_.passed(frame.robots.size());
  }
  frame.frame = frame_++;
  frame.capture_ns = captured_ns;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  frame.sent_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  writer_.write(frame);
}

void ArkBridge::on_packet(const PublicStationPacket& packet) {
  const std::lock_guard lock(mutex_);
  for (const ArkOrder& order : orders_of(packet.command, packet.message, door_.names, tally_)) {
    if (orders_.size() == kMostOrders) {
      ++orders_lost_;
      continue;
    }
    orders_.push_back(order);
  }
}

std::vector<ArkOrder> ArkBridge::take() {
  const std::lock_guard lock(mutex_);
  orders_taken_ += orders_.size();
  return std::exchange(orders_, {});
}

std::string ArkBridge::in_words() {
  const std::lock_guard lock(mutex_);
  std::string text = tally_.in_words() + fmt::format("; {} orders of the station", orders_taken_);
  if (orders_lost_ > 0) text += fmt::format(", {} lost because ARK took none", orders_lost_);
  return text;
}

}  // namespace kilotwin::doors
