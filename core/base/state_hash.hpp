/// The state hash of a run.
///   h(t) = sum mod 2^64 over entities and domains of H(domain, id, fields)
///   H(t) = chain(H(t-1), h(t)), H at the first tick 0
/// Fields are 64-bit words in a fixed order; doubles enter by their bits, -0 as 0. h(t) is a sum, so federates can add parts.
/// The hash detects differing runs; it does not resist deliberate collisions.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace kilotwin {

/// Kind of a hashed entity. Each federate hashes the entities that it owns.
enum class HashDomain : std::uint64_t {
  kBody = 1,
  kProgram = 2,
  kRadio = 3,
  kStation = 4,
  kContact = 5,
  kMovable = 6,
  kArenaField = 30,
  kMemory = 31,
  kTracked = 60
};

/// A double as a word. The state never holds a NaN, whose bits would differ between CPUs.
[[nodiscard]] inline std::uint64_t hash_bits(double value) { return std::bit_cast<std::uint64_t>(value + 0.0); }

/// Combines two words into one. For either argument fixed it is a bijection of the other, so no difference in one argument is
/// lost. Each bit of either argument flips each bit of the result with probability 1/2. The multipliers are odd words without
/// structure: the fractional parts of the square roots of 2, 3 and 5 in 64 bits, the first one made odd.
[[nodiscard]] constexpr std::uint64_t hash_mix(std::uint64_t a, std::uint64_t b) {
  a = (a ^ a >> 32) * 0x6a09e667f3bcc909u + b;
  a = (a ^ a >> 32) * 0xbb67ae8584caa73bu;
  a = (a ^ a >> 29) * 0x3c6ef372fe94f82bu;
  return a ^ a >> 32;
}

/// Hashes a sequence of words. The state has 128 bits. Every step is a bijection of the state and injective in the word, so
/// no word can erase the words before it. Only finish() folds the state. A word meets one half of the state while the other
/// half holds a product of the previous word, so small similar words do not cancel.
class HashState {
 public:
  constexpr explicit HashState(std::uint64_t first) { add(first); }

  constexpr void add(std::uint64_t word) {
    __extension__ using Wide = unsigned __int128;
    const Wide product = static_cast<Wide>(a_ ^ word) * 0xa54ff53a5f1d36f1u;  // as above, of the square root of 7
    a_ = b_ + static_cast<std::uint64_t>(product >> 64);
    b_ = static_cast<std::uint64_t>(product);
  }
  [[nodiscard]] constexpr std::uint64_t finish() const { return hash_mix(a_, b_); }

 private:
  std::uint64_t a_ = 0x510e527fade682d1u, b_ = 0x9b05688c2b3e6c1fu;  // as above, of the square roots of 11 and 13
};

/// H(domain, id, words).
[[nodiscard]] inline std::uint64_t entity_hash(HashDomain domain, std::uint32_t id,
                                               std::initializer_list<std::uint64_t> words) {
  HashState state(static_cast<std::uint64_t>(domain) << 32 | id);
  for (const std::uint64_t word : words) state.add(word);
  return state.finish();
}

/// Hash of a string of octets; the same on machines of either byte order.
[[nodiscard]] constexpr std::uint64_t hash_bytes(std::string_view bytes) {
  HashState state(bytes.size());
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    for (std::size_t i = at; i < at + 8 && i < bytes.size(); ++i) {
      word |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << 8 * (i - at);
    }
    state.add(word);
  }
  return state.finish();
}

/// H(t) from H(t-1) and h(t).
[[nodiscard]] inline std::uint64_t hash_chain(std::uint64_t previous, std::uint64_t sum) {
  return hash_mix(previous, sum);
}

}  // namespace kilotwin
