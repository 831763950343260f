/// Motion commands in the station's messages to robots. A real robot without a shadow program is
/// then watched by what it was sent.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/effects/robots.hpp"

namespace kilotwin::proto {
class EventRecord;
}

namespace kilotwin::monitor {

/// By the type of ARK's messages to robots, 0..15.
using StationCommands = std::map<std::uint8_t, MotionCommand>;

/// Reads "1=left,2=right,3=stop,4=straight". Throws UserError.
[[nodiscard]] StationCommands station_commands_of(std::string_view text);

/// One robot's command by one message.
struct SentCommand {
  std::uint32_t robot;
  std::int64_t offset_cycles;  ///< since the event's tick
  MotionCommand command;
};
/// The commands in packets of the station, as events record them; none of other events.
[[nodiscard]] std::vector<SentCommand> commands_in(const proto::EventRecord& event, const StationCommands& meaning);

}  // namespace kilotwin::monitor
