/// Counter-based random numbers: every draw is a pure function of (seed, stream, entity, tick, draw), so that no order of
/// evaluation, thread, partition or host can change it. Philox4x32-10 (Salmon et al., SC 2011).
#pragma once

#include <array>
#include <cstdint>

#include "core/base/time.hpp"

namespace kilotwin {

/// One name per purpose; a value, once released, keeps its meaning.
enum class Stream : std::uint16_t {
  kWheelBias = 1,        ///< draw 0 left, 1 right; tick 0
  kWheelFactor = 2,      ///< draw 0 left, 1 right; per tick
  kLayout = 3,           ///< placement of robots
  kOscillator = 4,       ///< draw 0 rate, 1 phase; tick 0
  kBackOff = 5,          ///< per aborted attempt
  kReception = 6,        ///< loss at a receiver
  kProgram = 7,          ///< what a robot's program calls hardware noise (rand_hard, readings)
};

/// Philox4x32 with 10 rounds.
[[nodiscard]] std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}
  /// 128 random bits. draw < 2^16, tick < 2^32.
  [[nodiscard]] std::array<std::uint32_t, 4> block(Stream, std::uint32_t entity, Tick, std::uint32_t draw) const;
  [[nodiscard]] std::uint64_t bits(Stream, std::uint32_t entity, Tick, std::uint32_t draw) const;
  /// Uniform in the open interval (0, 1): never 0, never 1; 52 bits.
  [[nodiscard]] double uniform(Stream, std::uint32_t entity, Tick, std::uint32_t draw) const;
  /// Standard normal, by the inverse of its distribution function.
  [[nodiscard]] double normal(Stream, std::uint32_t entity, Tick, std::uint32_t draw) const;

 private:
  std::uint64_t seed_;
};

}  // namespace kilotwin
