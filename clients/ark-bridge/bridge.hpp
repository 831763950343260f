/// Between the real ARK and a run, without ARK's types: the plugin hands robots in and orders out.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <variant>
#include <vector>

#include "clients/doors/door.hpp"
#include "clients/doors/tally.hpp"

namespace kilotwin::doors {

/// A robot as ARK's tracker knows it.
struct ArkRobot {
  std::uint16_t id = 0;
  double x_px = 0, y_px = 0;    ///< in ARK's picture, y down
  double vx_px = 0, vy_px = 0;  ///< per camera frame
  int colour = 0;               ///< 0 off, 1 red, 2 green, 3 blue
};

/// The arguments of ARK's signals.
struct ArkSignal {
  std::uint16_t id = 0;    ///< ARK's id of the robot
  std::uint8_t type = 0;   ///< 0 to 15
  std::uint16_t data = 0;  ///< 0 to 1023
  bool operator==(const ArkSignal&) const = default;
};
struct ArkBroadcast {
  std::uint8_t type = 0;  ///< 1 to 127
  std::array<std::uint8_t, 9> data{};
  bool operator==(const ArkBroadcast&) const = default;
};
/// Ends a broadcast.
struct ArkStop {
  bool operator==(const ArkStop&) const = default;
};
using ArkOrder = std::variant<ArkSignal, ArkBroadcast, ArkStop>;

/// Commands of a packet for an overhead controller: idl/public.idl.
inline constexpr std::uint8_t kStopCommand = 0, kRepeatCommand = 2, kOnceCommand = 6;

/// The orders to the real ARK that a packet of the simulated station means. Messages to robots that are not tracked are left out:
/// the simulated radio brings them. `message`: data[9], type.
[[nodiscard]] std::vector<ArkOrder> orders_of(std::uint8_t command, std::span<const std::uint8_t, 10> message,
                                              const RobotNames& names, Tally& tally);

/// ARK's robots as a frame's robots. A velocity too small to tell a direction leaves the heading open.
[[nodiscard]] std::vector<TrackedRobot> tracked_of(std::span<const ArkRobot> robots, const Door& door,
                                                   Tally& tally);

class ArkBridge {
 public:
  /// Joins the run's domain. Throws RunError where that fails.
  ArkBridge(Door door, const dds::Transport& run);
  ~ArkBridge();
  ArkBridge(const ArkBridge&) = delete;
  ArkBridge& operator=(const ArkBridge&) = delete;

  /// Publishes one frame. `captured_ns`: when ARK handed the robots over, ns of UTC.
  void publish(std::span<const ArkRobot> robots, std::int64_t captured_ns);
  /// The orders that came from the station since the last call, in order.
  [[nodiscard]] std::vector<ArkOrder> take();
  [[nodiscard]] const Door& door() const { return door_; }
  /// Whether a run reads what is published.
  [[nodiscard]] bool joined() const { return writer_.readers() > 0; }
  [[nodiscard]] std::string in_words();

 private:
  void on_packet(const PublicStationPacket& packet);

  Door door_;
  dds::Participant participant_;
  FrameWriter writer_;
  std::mutex mutex_;
  Tally tally_;
  std::uint64_t frame_ = 0, orders_taken_ = 0, orders_lost_ = 0;
  std::vector<ArkOrder> orders_;
  std::unique_ptr<dds::Reader<PublicStationPacket>> packets_;
};

}  // namespace kilotwin::doors
