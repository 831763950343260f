/// Counter-based random numbers: every draw is a pure function of (seed, stream, entity, tick, draw). It does not depend on
/// evaluation order, threads, partitions or hosts. Generator: Philox4x32-10 (Salmon et al., SC 2011).
#pragma once

#include <array>
#include <cstdint>

#include "core/base/error.hpp"
#include "core/base/time.hpp"

namespace kilotwin {

/// One stream per purpose. A released value never changes its meaning.
enum class Stream : std::uint16_t {
  kWheelBias = 1,          ///< draw 0 left, 1 right; tick 0
  kWheelFactor = 2,        ///< draw 0 left, 1 right; per tick
  kLayout = 3,             ///< placement of robots
  kOscillator = 4,         ///< draw 0 rate, 1 phase; tick 0
  kBackOff = 5,            ///< per aborted attempt
  kReception = 6,          ///< loss at a receiver
  kProgram = 7,            ///< hardware noise that a robot's program reads: rand_hard, readings
  kLink = 8,               ///< offsets of robots and pairs in infrared strength; once per run
  kPacket = 9,             ///< noise of a packet's strength at a receiver
  kSolver = 20,            ///< seed of ODE's iterative solver; per sub-step; entity: lowest robot of the group
  kLightSensor = 25,       ///< draw 0 logarithm of the gain, 1 offset; tick 0
  kBattery = 26,           ///< draw 0 charge at the start
  kTemperature = 27,       ///< draw 0 offset of a robot's sensor
  kEffectNoise = 30,       ///< independent noise of effects on motion, per tick
  kCorrelatedNoise = 31,   ///< correlated noise of effects, per tick
  kMeasurementNoise = 32,  ///< independent noise of effects on measurements, per tick
  kEpisodes = 90,          ///< begin and end of effects' episodes, drawn at the previous tick; the effect's draw
  kStationCamera = 100,    ///< errors of the station's camera; tick: its frame
  kStationPlugin = 101,    ///< draws of plugins; entity: the environment + 2^16 per 2^16 draws
  kConverter = 35,         ///< noise of a firmware robot's analogue converter; tick: its conversions / 2^16
};

/// Philox4x32 with 10 rounds. Multipliers and key increments are those of Salmon et al. (SC 2011; the increments: the golden ratio and
/// the square root of 3, less 1, times 2^32).
[[nodiscard]] constexpr std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                                                std::array<std::uint32_t, 2> key) {
  auto [c0, c1, c2, c3] = counter;
  auto [k0, k1] = key;
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product0 = std::uint64_t{0xd2511f53u} * c0;
    const std::uint64_t product1 = std::uint64_t{0xcd9e8d57u} * c2;
    c0 = static_cast<std::uint32_t>(product1 >> 32) ^ c1 ^ k0;
    c1 = static_cast<std::uint32_t>(product1);
    c2 = static_cast<std::uint32_t>(product0 >> 32) ^ c3 ^ k1;
    c3 = static_cast<std::uint32_t>(product0);
    k0 += 0x9e3779b9u;
    k1 += 0xbb67ae85u;
  }
  return {c0, c1, c2, c3};
}

/// Random numbers of one seed. The seed is the key. (stream, entity, tick, block) fill the 128 bits of the counter without
/// overlap. A block holds two draws: draws 2b and 2b+1 are the halves of block b. The functions with `pair` return both
/// for the cost of one.
class Random {
 public:
  explicit Random(std::uint64_t seed)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)} {}

  /// 128 random bits: those of draws 2b and 2b+1. b < 2^16.
  [[nodiscard]] std::array<std::uint32_t, 4> block(Stream stream, std::uint32_t entity, Tick tick,
                                                   std::uint32_t b) const {
    KILOTWIN_DEMAND(b < 0x10000u);
    const auto count = static_cast<std::uint64_t>(tick.count());
    return philox4x32({static_cast<std::uint32_t>(count), entity, static_cast<std::uint32_t>(stream) << 16 | b,
                       static_cast<std::uint32_t>(count >> 32)},
                      key_);
  }
  /// 64 random bits. draw < 2^17.
  [[nodiscard]] std::uint64_t bits(Stream stream, std::uint32_t entity, Tick tick, std::uint32_t draw) const {
    return bits_pair(stream, entity, tick, draw / 2)[draw % 2];
  }
  /// Uniform in the open interval (0, 1): never 0, never 1; 52 bits.
  [[nodiscard]] double uniform(Stream stream, std::uint32_t entity, Tick tick, std::uint32_t draw) const {
    return uniform_of(bits(stream, entity, tick, draw));
  }
  /// Standard normal, by the inverse of its distribution function: |value| < 8.3.
  [[nodiscard]] double normal(Stream, std::uint32_t entity, Tick, std::uint32_t draw) const;

  // Draws 2b and 2b+1.
  [[nodiscard]] std::array<std::uint64_t, 2> bits_pair(Stream stream, std::uint32_t entity, Tick tick,
                                                       std::uint32_t b) const {
    const auto word = block(stream, entity, tick, b);
    return {std::uint64_t{word[1]} << 32 | word[0], std::uint64_t{word[3]} << 32 | word[2]};
  }
  [[nodiscard]] std::array<double, 2> uniform_pair(Stream stream, std::uint32_t entity, Tick tick,
                                                   std::uint32_t b) const {
    const auto pair = bits_pair(stream, entity, tick, b);
    return {uniform_of(pair[0]), uniform_of(pair[1])};
  }
  [[nodiscard]] std::array<double, 2> normal_pair(Stream, std::uint32_t entity, Tick, std::uint32_t b) const;

 private:
  /// The middle of one of 2^52 equal cells of (0, 1); exact.
  [[nodiscard]] static double uniform_of(std::uint64_t bits) {
    return (static_cast<double>(static_cast<std::int64_t>(bits >> 12)) + 0.5) * 0x1p-52;
  }

  std::array<std::uint32_t, 2> key_;
};

}  // namespace kilotwin
