#include "clients/view/request.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "clients/view/outside.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::view {
namespace {

using nlohmann::json;
using Kind = Request::Kind;

constexpr std::array<std::pair<std::string_view, Kind>, 20> kKinds{
    {{"hello", Kind::kHello},     {"next", Kind::kNext},         {"at", Kind::kAt},
     {"trail", Kind::kTrail},     {"robot", Kind::kRobot},       {"plots", Kind::kPlots},
     {"plot", Kind::kPlot},       {"program", Kind::kProgram},   {"outside", Kind::kOutside},
     {"flights", Kind::kFlights}, {"floors", Kind::kFloors},     {"light", Kind::kLight},
     {"work", Kind::kWork},       {"marks", Kind::kMarks},       {"overhead", Kind::kOverhead},
     {"pause", Kind::kPause},     {"continue", Kind::kContinue}, {"step", Kind::kStep},
     {"stop", Kind::kStop},       {"place", Kind::kPlace}}};

/// A whole number of the object, at least `lowest`; nothing where it is absent or another value.
template <class Whole> std::optional<Whole> whole(const json& object, const char* key, std::int64_t lowest) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_integer()) return std::nullopt;
  if (found->is_number_unsigned() &&
      found->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<Whole>::max()))
    return std::nullopt;
  const auto value = found->get<std::int64_t>();
  if (value < lowest) return std::nullopt;
  return static_cast<Whole>(value);
}

/// Takes a field that the request must have.
template <class Whole> bool take(const json& object, const char* key, std::int64_t lowest, Whole& to) {
  const std::optional<Whole> value = whole<Whole>(object, key, lowest);
  if (value) to = *value;
  return value.has_value();
}

/// Packets whose payload is one message, and those that end it.
bool take_packet(const json& object, OverheadPacket& packet) {
  std::uint32_t command = 0;
  const auto message = object.find("message");
  if (!take(object, "command", 0, command) || message == object.end() || !message->is_string()) return false;
  const std::optional<IrMessage> octets = message_of(message->get_ref<const std::string&>());
  if (!octets || command > static_cast<std::uint32_t>(OverheadCommand::kOnce)) return false;
  packet.command = static_cast<OverheadCommand>(command);
  packet.message = *octets;
  return packet.command == OverheadCommand::kStop || packet.command == OverheadCommand::kRepeat ||
         packet.command == OverheadCommand::kOnce;
}

/// A finite number that the request must have.
bool take_number(const json& object, const char* key, double& to) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return false;
  to = found->get<double>();
  return std::isfinite(to);
}

bool take_place(const json& object, Relocation& place) {
  place.movable = object.contains("movable");
  if (!take(object, place.movable ? "movable" : "robot", 0, place.body) ||
      !take_number(object, "x", place.pose.x_mm) || !take_number(object, "y", place.pose.y_mm) ||
      !take_number(object, "heading", place.pose.heading_rad))
    return false;
  place.pose.heading_rad = wrapped(std::remainder(place.pose.heading_rad, 2 * kPi));
  return true;
}

bool take_fields(const json& object, Request& request) {
  switch (request.kind) {
    case Kind::kHello: {
      const auto token = object.find("token");
      if (token == object.end() || !token->is_string()) return false;
      request.token = token->get<std::string>();
      return true;
    }
    case Kind::kAt: return take(object, "tick", 0, request.tick) && take(object, "request", 1, request.number);
    case Kind::kTrail:
    case Kind::kRobot:
    case Kind::kProgram: return take(object, "tick", 0, request.tick) && take(object, "robot", 0, request.robot);
    case Kind::kFloors:
    case Kind::kLight:
    case Kind::kOutside: return take(object, "tick", 0, request.tick);
    case Kind::kFlights: return take(object, "from", -1, request.from) && take(object, "tick", 0, request.tick);
    case Kind::kPlace: return take_place(object, request.place);
    case Kind::kOverhead: return take_packet(object, request.packet);
    case Kind::kPlot:
      request.of_robot = object.contains("robot");
      return take(object, "plot", 0, request.number) &&
             (!request.of_robot || take(object, "robot", 0, request.robot));
    case Kind::kStep: return take(object, "steps", 1, request.steps) && request.steps <= kMostSteps;
    default: return true;
  }
}

}  // namespace

std::optional<Request> parse_request(std::string_view text) {
  if (text.size() > kLongestRequest_bytes) return std::nullopt;
  const json object = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) return std::nullopt;
  const auto word = object.find("do");
  if (word == object.end() || !word->is_string()) return std::nullopt;
  for (const auto& [name, kind] : kKinds) {
    if (word->get_ref<const std::string&>() != name) continue;
    Request request;
    request.kind = kind;
    if (!take_fields(object, request)) return std::nullopt;
    return request;
  }
  return std::nullopt;
}

}  // namespace kilotwin::view
