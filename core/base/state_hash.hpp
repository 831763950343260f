/// The state hash of a run.
///   h(t) = sum mod 2^64 over entities and domains of H(domain, id, fields)
///   H(t) = chain(H(t-1), h(t)), H at the first tick 0
/// Fields are 64-bit words in a fixed order; doubles enter by their bits, -0 as 0. A sum, so that federates add up parts.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>

namespace kilotwin {

/// Whose fields: each federate hashes what it owns.
enum class HashDomain : std::uint64_t { kBody = 1, kProgram = 2, kRadio = 3, kStation = 4 };

[[nodiscard]] inline std::uint64_t hash_bits(double value) { return std::bit_cast<std::uint64_t>(value + 0.0); }

/// 64 x 64 -> 128 bit multiply, halves xored: the mixing step.
[[nodiscard]] inline std::uint64_t hash_mix(std::uint64_t a, std::uint64_t b) {
  __extension__ using Wide = unsigned __int128;
  const Wide product = static_cast<Wide>(a) * b;
  return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

/// H(domain, id, words).
[[nodiscard]] inline std::uint64_t entity_hash(HashDomain domain, std::uint32_t id,
                                               std::initializer_list<std::uint64_t> words) {
  std::uint64_t h = hash_mix(static_cast<std::uint64_t>(domain) * 0x9e3779b97f4a7c15u ^ id, 0xd6e8feb86659fd93u);
  for (const std::uint64_t word : words) h = hash_mix(h ^ word ^ 0xa0761d6478bd642fu, (h << 23 | h >> 41) ^ 0xe7037ed1a0b428dbu);
  return h ^ h >> 32;
}

/// H(t) from H(t-1) and h(t).
[[nodiscard]] inline std::uint64_t hash_chain(std::uint64_t previous, std::uint64_t sum) {
  return hash_mix(previous ^ 0x8ebc6af09c88c6e3u, sum ^ 0x589965cc75374cc3u) + sum;
}

}  // namespace kilotwin
