/// External input of a run, for viewers: where trackers saw robots and how sure they are, and packets for the overhead
/// controller.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/frames/overhead_packet.hpp"
#include "core/frames/tracker_sample.hpp"
#include "core/plan/tracking_settings.hpp"

namespace kilotwin::view {

inline constexpr std::size_t kMostPackets = 8, kMostAlarms = 20;  ///< that a viewer is told of

/// A tracked robot in the arena's frame, with the covariance of its position.
struct TrackedPlace {
  std::uint32_t robot = 0;
  double x_mm = 0, y_mm = 0, xx_mm2 = 0, xy_mm2 = 0, yy_mm2 = 0;
};

/// A packet that the station sends or was sent.
struct ShownPacket {
  double time_s = 0;  ///< simulated
  std::uint8_t command = 0;
  IrMessage message{};
};

struct Outside {
  std::vector<TrackedPlace> robots;
  std::vector<ShownPacket> packets;  ///< oldest first
  std::vector<std::string> alarms;   ///< lines of the residual monitor, oldest first
};

/// The robots that a sample holds and that the tracker has not lost. Robots that are listed already stay as they are.
void add_places(const std::vector<TrackerSettings>& trackers, const TrackerSample& sample,
                std::map<std::uint32_t, TrackedPlace>& to);
/// The octets of a message from 20 hexadecimal digits; nothing where they are none.
[[nodiscard]] std::optional<IrMessage> message_of(std::string_view hexadecimal);
/// The last alarms of the residual monitor up to a time, kMostAlarms at most, from the run's alarms.txt. Empty where there is no
/// such file.
[[nodiscard]] std::vector<std::string> alarms_until(const std::filesystem::path& file, double until_s);
/// A message of type "outside".
[[nodiscard]] std::string outside_text(std::int64_t tick, const Outside&);

}  // namespace kilotwin::view
