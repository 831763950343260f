/// A viewer's request: one JSON object per message, at most kLongestRequest_bytes.
///
///   {"do": "hello", "token": "..."}      shows that it may steer the run
///   {"do": "next"}                       the next state of a live run, once
///   {"do": "at", "tick": T, "request": N}    the recorded state at or before tick T
///   {"do": "trail", "robot": R, "tick": T}   the recorded path of a robot up to tick T
///   {"do": "robot", "robot": R, "tick": T}   counters of a robot up to tick T
///   {"do": "plots"}                      what can be plotted
///   {"do": "plot", "plot": P, "robot": R}    a curve over time, of a robot, or without R of the swarm
///   {"do": "program", "robot": R, "tick": T} variables and log of a robot's program up to tick T
///   {"do": "outside", "tick": T}         what trackers saw, and packets for the overhead controller, up to tick T
///   {"do": "flights", "from": T, "tick": T}  messages that ended after the first tick, up to the second
///   {"do": "floors", "tick": T}          what lies on the floor of a live run, if it has changed
///   {"do": "light", "tick": T}           light on the floor and lamps at tick T
///   {"do": "work"}                       where the time of the federates goes
///   {"do": "marks"}                      marks of the time line
///   {"do": "pause"} {"do": "continue"} {"do": "step", "steps": N} {"do": "stop"}
///   {"do": "overhead", "command": C, "message": "20 hexadecimal digits"}    a packet for the overhead controller
///   {"do": "place", "robot": R, "x": X, "y": Y, "heading": H}    places a robot, mm and rad; "movable" in place of "robot": a body
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/frames/frames.hpp"
#include "core/frames/overhead_packet.hpp"

namespace kilotwin::view {

inline constexpr std::size_t kLongestRequest_bytes = 512;
inline constexpr std::uint32_t kMostSteps = 1'000'000;

struct Request {
  enum class Kind : std::uint8_t {
    kHello,
    kNext,
    kAt,
    kTrail,
    kRobot,
    kPlots,
    kPlot,
    kProgram,
    kOutside,
    kFlights,
    kFloors,
    kLight,
    kWork,
    kMarks,
    kPause,
    kContinue,
    kStep,
    kStop,
    kOverhead,
    kPlace
  };
  Kind kind = Kind::kNext;
  std::string token;         ///< with kHello
  std::int64_t tick = 0;     ///< with kAt, kTrail, kRobot, kProgram, kOutside, kFlights, kFloors and kLight
  std::int64_t from = 0;     ///< with kFlights
  std::uint32_t number = 0;  ///< with kAt and kPlot
  std::uint32_t robot = 0;   ///< with kTrail, kRobot, kProgram, and kPlot if `of_robot`
  bool of_robot = false;     ///< with kPlot
  std::uint32_t steps = 1;   ///< with kStep
  OverheadPacket packet;     ///< with kOverhead
  Relocation place;          ///< with kPlace; its heading is in [-pi, pi)

  [[nodiscard]] bool steers() const { return kind >= Kind::kPause; }
};

/// Nothing where the text is no request.
[[nodiscard]] std::optional<Request> parse_request(std::string_view text);

}  // namespace kilotwin::view
