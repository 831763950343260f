/// Packets of the overhead controller's serial line: 132 octets, first 0x55, then type and payload, last a checksum that
/// makes the exclusive or of all octets 0. There is no reply and no other framing: a receiver looks at the last 132 octets
/// after each one that arrives. Source: the serial protocol of kilolib's controller.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/frames/overhead_packet.hpp"

namespace kilotwin::ohc {

inline constexpr std::size_t kSerialPacket = 132;
inline constexpr std::uint8_t kHeader = 0x55;
/// 38400 baud, 8 data bits, a start and a stop bit.
inline constexpr int kOctetsPerSecond = 3840;
/// How long a controller that is switched on blinks before it listens, s.
inline constexpr double kStartUp_s = 2.0;
/// How long a controller that sends a page has its interrupts off and loses octets, s: 22 messages of 4.371 ms, rounded up. The LED
/// flash after them hears octets. With the 34.4 ms of a packet on the line this gives 131 ms per page, the pace of KiloGUI.
inline constexpr double kPage_s = 0.097;

using SerialPacket = std::array<std::uint8_t, kSerialPacket>;

[[nodiscard]] SerialPacket encode(const OverheadPacket&);

/// Finds packets in a stream of octets.
class PacketDecoder {
 public:
  struct Counters {
    std::uint64_t octets = 0;
    std::uint64_t packets = 0;
    /// Stretches of 132 octets that begin with the header, end with a wrong checksum, and share no octet with a packet or
    /// with one another.
    std::uint64_t bad_checksums = 0;
    std::uint64_t unknown_types = 0;  ///< whole packets of a type above 6
  };

  /// Takes the next octet. Returns the packet that it ends, if that is whole and of a known type.
  [[nodiscard]] std::optional<OverheadPacket> take(std::uint8_t octet);
  /// Discards the octets received so far; they belong to no packet. Counters keep their values.
  void forget();
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] std::uint8_t at(std::size_t i) const { return window_[(first_ + i) % kSerialPacket]; }

  std::array<std::uint8_t, kSerialPacket> window_{};  ///< the last octets, a ring
  std::size_t first_ = 0;                             ///< where the oldest one is
  std::uint8_t sum_ = 0;                              ///< exclusive or of the window
  std::size_t loose_ = 0;  ///< octets since the last packet or bad checksum, at most kSerialPacket
  Counters counters_;
};

}  // namespace kilotwin::ohc
