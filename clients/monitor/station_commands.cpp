#include "clients/monitor/station_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "clients/monitor/command_table.hpp"
#include "core/base/error.hpp"
#include "core/frames/overhead_packet.hpp"
#include "idl/recording.pb.h"
#include "services/ark/ark_message.hpp"

namespace kilotwin::monitor {
namespace {

constexpr unsigned kMostTypes = 16;

[[noreturn]] void refuse(std::string_view entry) {
  throw UserError(
      fmt::format("--station-commands: \"{}\" is no TYPE=MOTION; expected types 0 to 15 with stop, straight, left "
                  "or right, as in "
                  "1=left,2=right,3=stop,4=straight",
                  entry));
}

/// Octets of hexadecimal text; nothing where it is damaged.
std::optional<IrMessage> message_of(const std::string& text) {
  IrMessage message{};
  if (text.size() != 2 * message.size()) return std::nullopt;
  for (std::size_t i = 0; i < message.size(); ++i) {
    const char* const begin = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, message[i], 16);
    if (error != std::errc() || end != begin + 2) return std::nullopt;
  }
  return message;
}

}  // namespace

StationCommands station_commands_of(std::string_view text) {
  StationCommands commands;
  while (!text.empty()) {
    const std::string_view entry = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), entry.size() + 1));
    unsigned type = kMostTypes;
    const auto [end, error] = std::from_chars(entry.data(), entry.data() + entry.size(), type);
    const auto at = static_cast<std::size_t>(end - entry.data());
    if (error != std::errc() || type >= kMostTypes || at >= entry.size() || entry[at] != '=') refuse(entry);
    const std::optional<MotionCommand> command = command_named(entry.substr(at + 1));
    if (!command) refuse(entry);
    commands[static_cast<std::uint8_t>(type)] = *command;
  }
  if (commands.empty()) refuse(text);
  return commands;
}

std::vector<SentCommand> commands_in(const proto::EventRecord& event, const StationCommands& meaning) {
  std::vector<SentCommand> sent;
  if (event.kind() != proto::STATION) return sent;
  for (int i = 0; i < event.text_size() && i < event.value_size() && i < event.offset_cycles_size(); ++i) {
    const auto how = static_cast<OverheadCommand>(event.value(i));
    if (how != OverheadCommand::kRepeat && how != OverheadCommand::kOnce) continue;
    const std::optional<IrMessage> message = message_of(event.text(i));
    if (!message || message->back() != 0) continue;
    for (const ark::ArkMessage& slot : ark::unpack(*message)) {
      const auto found = meaning.find(slot.type);
      if (slot.id != ark::kArkNobody && found != meaning.end())
        sent.push_back({slot.id, event.offset_cycles(i), found->second});
    }
  }
  return sent;
}

}  // namespace kilotwin::monitor
