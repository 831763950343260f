#include "clients/view/outside.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/trackers/measured_pose.hpp"

namespace kilotwin::view {
namespace {

using nlohmann::json;

/// TrackerFrame.state of idl/public.idl: the tracker has lost the robot.
constexpr std::uint8_t kLost = 2;

/// A tenth of a millimetre is enough for a picture.
double rounded(double value) { return std::round(10 * value) / 10; }

}  // namespace

void add_places(const std::vector<TrackerSettings>& trackers, const TrackerSample& sample,
                std::map<std::uint32_t, TrackedPlace>& to) {
  const TrackerSettings tracker = sample.source < trackers.size() ? trackers[sample.source] : TrackerSettings{};
  for (std::size_t n = 0; n < sample.robot.size(); ++n) {
    if (sample.state[n] == kLost) continue;
    const MeasuredPose pose = measured_pose(tracker, sample, n);
    if (pose.is_near())
      to.try_emplace(sample.robot[n],
                     TrackedPlace{sample.robot[n], pose.x_mm, pose.y_mm, pose.xx, pose.xy, pose.yy});
  }
}

std::optional<IrMessage> message_of(std::string_view hexadecimal) {
  IrMessage message{};
  if (hexadecimal.size() != 2 * message.size()) return std::nullopt;
  for (std::size_t i = 0; i < message.size(); ++i) {
    const char* const from = hexadecimal.data() + 2 * i;
    const auto [end, error] = std::from_chars(from, from + 2, message[i], 16);
    if (error != std::errc() || end != from + 2) return std::nullopt;
  }
  return message;
}

std::vector<std::string> alarms_until(const std::filesystem::path& file, double until_s) {
  constexpr std::string_view kBefore = "monitor: ";  // the time, s
  std::vector<std::string> alarms;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(kBefore) || std::strtod(line.c_str() + kBefore.size(), nullptr) > until_s) continue;
    if (alarms.size() == kMostAlarms) alarms.erase(alarms.begin());
    alarms.push_back(line.substr(kBefore.size()));
  }
  return alarms;
}

std::string outside_text(std::int64_t tick, const Outside& outside) {
  json robots = json::array(), places = json::array(), packets = json::array();
  for (const TrackedPlace& place : outside.robots) {
    robots.push_back(place.robot);
    for (const double value : {place.x_mm, place.y_mm}) places.push_back(rounded(value));
    for (const double value : {place.xx_mm2, place.xy_mm2, place.yy_mm2}) places.push_back(value);
  }
  for (const ShownPacket& packet : outside.packets) {
    std::string octets;
    for (const std::uint8_t octet : packet.message) octets += fmt::format("{:02x}", octet);
    packets.push_back({{"time", packet.time_s}, {"command", packet.command}, {"message", octets}});
  }
  return json{{"type", "outside"}, {"tick", tick},       {"robots", robots},
              {"places", places},  {"packets", packets}, {"alarms", outside.alarms}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace kilotwin::view
