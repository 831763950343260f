#include "clients/ohc/packet_log.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <numeric>

namespace kilotwin::ohc {
namespace {

constexpr std::array kCommands{"stop", "LED", "repeated", "raw", "page", "GPS frame", "single"};

/// kilolib's message types.
std::string message_in_words(const IrMessage& message) {
  constexpr std::uint8_t kBoot = 0x80, kProgramSize = 0x82;
  constexpr std::array kNames{"BOOT",   "page part", "",    "RESET",   "SLEEP", "WAKEUP",
                              "CHARGE", "VOLTAGE",   "RUN", "READUID", "CALIB"};
  const std::uint8_t type = message.back();
  if (type == kProgramSize) return fmt::format("size of a program, {} pages", message[0]);
  if (type >= kBoot && type - kBoot < static_cast<int>(kNames.size())) return kNames[type - std::size_t{kBoot}];
  return fmt::format("message of type {}", type);
}

}  // namespace

std::string kind_in_words(const OverheadPacket& packet) {
  switch (packet.command) {
    case OverheadCommand::kStop: return "STOP";
    case OverheadCommand::kLedToggle: return "LED toggle";
    case OverheadCommand::kRepeat: return message_in_words(packet.message) + ", repeated";
    case OverheadCommand::kRaw: return "raw message, repeated";
    case OverheadCommand::kBootPage: return "pages of a program";
    case OverheadCommand::kGpsFrame: return "GPS frames";
    case OverheadCommand::kOnce: return message_in_words(packet.message) + ", once";
  }
  return "unknown";
}

void PacketLog::note(const OverheadPacket& packet, double time_s) {
  ++count_[static_cast<std::size_t>(packet.command)];
  std::string kind = kind_in_words(packet);
  if (packet.command == OverheadCommand::kLedToggle) {
    led_ = !led_;
    kind = led_ ? "LED on" : "LED off";
  }
  if (kind == kind_) return;
  kind_ = kind;
  fmt::print("{:9.3f} s  {}\n", time_s, kind);
  std::fflush(stdout);
}

std::string PacketLog::counts() const {
  std::string parts;
  for (std::size_t i = 0; i < count_.size(); ++i) {
    if (count_[i] > 0) parts += fmt::format("{}{} {}", parts.empty() ? "" : ", ", count_[i], kCommands[i]);
  }
  const std::uint64_t all = std::accumulate(count_.begin(), count_.end(), std::uint64_t{0});
  return fmt::format("{} packets{}{}{}", all, parts.empty() ? "" : " (", parts, parts.empty() ? "" : ")");
}

}  // namespace kilotwin::ohc
