// The serial protocol of the overhead controller: what a writer of packets and a reader of octets promise one another.
#include "clients/ohc/serial_packet.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace kilotwin::ohc {
namespace {

OverheadPacket random_packet(std::mt19937& random) {
  OverheadPacket packet;
  packet.command = static_cast<OverheadCommand>(random() % 7);
  const bool is_short = random() % 2 == 0;
  for (std::uint8_t& octet : packet.message) octet = static_cast<std::uint8_t>(random());
  if (!is_short)
    for (std::uint8_t& octet : packet.rest) octet = static_cast<std::uint8_t>(random());
  return packet;
}

/// All packets that a decoder finds in octets.
template <class Octets> std::vector<OverheadPacket> take_all(PacketDecoder& decoder, const Octets& octets) {
  std::vector<OverheadPacket> packets;
  for (const std::uint8_t octet : octets) {
    if (const auto packet = decoder.take(octet)) packets.push_back(*packet);
  }
  return packets;
}

TEST(SerialPacket, LiesOnTheLineAsTheProtocolSays) {
  OverheadPacket packet{OverheadCommand::kRepeat, {1, 2, 3, 4, 5, 6, 7, 8, 9, 0x88}};
  const SerialPacket run = encode(packet);
  EXPECT_EQ(run.size(), 132u);
  EXPECT_EQ(run[0], 0x55);
  EXPECT_EQ(run[1], 2);
  EXPECT_EQ(run[2], 1);
  EXPECT_EQ(run[11], 0x88);
  EXPECT_EQ(run[12], 0);
  EXPECT_EQ(run[131], 0x55 ^ 2 ^ 1 ^ 2 ^ 3 ^ 4 ^ 5 ^ 6 ^ 7 ^ 8 ^ 9 ^ 0x88);
  OverheadPacket page;
  page.command = OverheadCommand::kBootPage;
  std::array<std::uint8_t, 129> payload{};
  payload[0] = 17;
  payload[1] = 0xaa;
  payload[128] = 0xbb;
  page.set_payload(payload);
  const SerialPacket octets = encode(page);
  EXPECT_EQ(octets[1], 4);
  EXPECT_EQ(octets[2], 17);
  EXPECT_EQ(octets[3], 0xaa);
  EXPECT_EQ(octets[130], 0xbb);
}

TEST(SerialPacket, EveryPacketComesBackWhole) {
  std::mt19937 random(1);
  PacketDecoder decoder;
  for (int n = 0; n < 2000; ++n) {
    const OverheadPacket packet = random_packet(random);
    const SerialPacket octets = encode(packet);
    std::uint8_t sum = 0;
    for (const std::uint8_t octet : octets) sum ^= octet;
    EXPECT_EQ(sum, 0);
    const auto packets = take_all(decoder, octets);
    ASSERT_FALSE(packets.empty()) << n;
    EXPECT_EQ(packets.back(), packet) << n;
    const auto back = packet_of(octets_of(packet));
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, packet);
  }
  EXPECT_EQ(decoder.counters().octets, 2000u * 132);
  EXPECT_EQ(decoder.counters().packets, 2000u);
  EXPECT_EQ(decoder.counters().bad_checksums, 0u);
}

/// One bit wrong anywhere but in the header spoils the packet, the packet alone, and is counted once.
TEST(SerialPacket, AWrongBitCostsOnePacket) {
  std::mt19937 random(2);
  for (std::size_t bit = 8; bit < kSerialPacket * 8; ++bit) {
    PacketDecoder decoder;
    const OverheadPacket first = random_packet(random),
                         second{OverheadCommand::kOnce, {static_cast<std::uint8_t>(bit)}};
    SerialPacket octets = encode(first);
    octets[bit / 8] = static_cast<std::uint8_t>(octets[bit / 8] ^ 1 << bit % 8);
    EXPECT_TRUE(take_all(decoder, octets).empty());
    EXPECT_EQ(decoder.counters().bad_checksums, 1u);
    const auto packets = take_all(decoder, encode(second));
    ASSERT_FALSE(packets.empty()) << bit;
    EXPECT_EQ(packets.back(), second);
    EXPECT_EQ(decoder.counters().bad_checksums, 1u);
  }
}

TEST(SerialPacket, ACutPacketCostsItself) {
  std::mt19937 random(3);
  for (std::size_t length = 0; length < kSerialPacket; ++length) {
    PacketDecoder decoder;
    const SerialPacket cut = encode(random_packet(random));
    for (std::size_t i = 0; i < length; ++i) static_cast<void>(decoder.take(cut[i]));
    const OverheadPacket whole = random_packet(random);
    const auto packets = take_all(decoder, encode(whole));
    ASSERT_FALSE(packets.empty()) << length;
    EXPECT_EQ(packets.back(), whole);
  }
}

/// KiloGUI's and ARK's idle stream: each STOP ends with 0x55, so that the window is right once more an octet early.
TEST(SerialPacket, AStreamOfStopsIsThatManyStops) {
  PacketDecoder decoder;
  std::size_t stops = 0;
  for (int n = 0; n < 100; ++n) stops += take_all(decoder, encode({})).size();
  EXPECT_EQ(stops, 100u);
  EXPECT_EQ(decoder.counters().unknown_types, 0u);
}

TEST(SerialPacket, UnknownTypesAreCountedAndDropped) {
  PacketDecoder decoder;
  OverheadPacket packet{static_cast<OverheadCommand>(7), {1}};
  EXPECT_TRUE(take_all(decoder, encode(packet)).empty());
  EXPECT_EQ(decoder.counters().unknown_types, 1u);
  EXPECT_EQ(decoder.counters().packets, 0u);
}

TEST(SerialPacket, NothingIsTakenForAPacketBeforeItHasCome) {
  PacketDecoder decoder;
  const SerialPacket stop = encode({});
  // All octets but the first are missing: the empty window must not make up for them.
  EXPECT_FALSE(decoder.take(stop.back()));
  for (std::size_t i = 0; i < kSerialPacket; ++i) EXPECT_FALSE(decoder.take(0)) << i;
  SerialPacket run = encode({OverheadCommand::kRepeat, {}});
  for (std::size_t i = 0; i < 131; ++i) EXPECT_FALSE(decoder.take(run[i]));
  decoder.forget();
  EXPECT_FALSE(decoder.take(run[131]));
}

/// A million octets of noise, headers, and packets whole, cut, doubled, with octets changed, lost and put in between. The
/// search finds the same packets as a reader that looks at every window anew, and a good packet after it all is taken.
TEST(SerialPacketFuzz, AMillionOctets) {
  std::mt19937 random(4);
  std::vector<std::uint8_t> octets;
  while (octets.size() < 1'000'000) {
    const SerialPacket packet = encode(random_packet(random));
    std::vector<std::uint8_t> piece(packet.begin(), packet.end());
    switch (random() % 8) {
      case 0: piece.resize(random() % piece.size()); break;
      case 1: piece[random() % piece.size()] = static_cast<std::uint8_t>(random()); break;
      case 2: piece.erase(piece.begin() + static_cast<std::ptrdiff_t>(random() % piece.size())); break;
      case 3:
        piece.insert(piece.begin() + static_cast<std::ptrdiff_t>(random() % piece.size()),
                     static_cast<std::uint8_t>(random()));
        break;
      case 4:
        piece.assign(random() % 300, 0);
        for (std::uint8_t& octet : piece) octet = static_cast<std::uint8_t>(random());
        break;
      case 5: piece.assign(random() % 300, kHeader); break;
      case 6: piece.insert(piece.end(), packet.begin(), packet.end()); break;
      default: break;
    }
    octets.insert(octets.end(), piece.begin(), piece.end());
  }
  PacketDecoder decoder;
  std::size_t found = 0, expected = 0;
  for (std::size_t end = 1; end <= octets.size(); ++end) {
    const auto packet = decoder.take(octets[end - 1]);
    bool whole =
        end >= kSerialPacket && octets[end - kSerialPacket] == kHeader && octets[end - kSerialPacket + 1] <= 6;
    if (whole) {
      std::uint8_t sum = 0;
      for (std::size_t i = end - kSerialPacket; i < end; ++i) sum ^= octets[i];
      whole = sum == 0;
    }
    found += packet.has_value();
    expected += whole;
    ASSERT_EQ(packet.has_value(), whole) << "octet " << end;
    if (!packet) continue;
    const SerialPacket again = encode(*packet);
    ASSERT_TRUE(
        std::equal(again.begin(), again.end(), octets.begin() + static_cast<std::ptrdiff_t>(end - kSerialPacket)));
  }
  EXPECT_EQ(found, expected);
  EXPECT_GT(found, 2000u);
  EXPECT_GT(decoder.counters().bad_checksums, 500u);
  const OverheadPacket good = random_packet(random);
  const auto packets = take_all(decoder, encode(good));
  ASSERT_FALSE(packets.empty());
  EXPECT_EQ(packets.back(), good);
}

}  // namespace
}  // namespace kilotwin::ohc
