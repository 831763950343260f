#include "core/base/state_hash.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace kilotwin {
namespace {

/// `of(bit)` is the value of a function with that input bit flipped, `of(-1)` without a flip. Counts how often each input bit
/// flips each output bit. Returns the largest distance of a frequency from 1/2, in standard errors.
template <class Function> double worst_avalanche(int inputs, const Function& of) {
  constexpr int kRounds = 4096;
  std::mt19937_64 random(9);
  double worst = 0;
  std::vector<std::array<int, 64>> flips(static_cast<std::size_t>(inputs));
  for (int round = 0; round < kRounds; ++round) {
    const std::array<std::uint64_t, 4> words = {random(), random(), random(), random()};
    const std::uint64_t base = of(words, -1);
    for (int bit = 0; bit < inputs; ++bit) {
      const std::uint64_t changed = base ^ of(words, bit);
      auto& row = flips[static_cast<std::size_t>(bit)];
      for (unsigned out = 0; out < 64; ++out) row[out] += static_cast<int>(changed >> out & 1);
    }
  }
  for (const auto& row : flips) {
    for (const int count : row)
      worst = std::fmax(worst, std::fabs(count - kRounds / 2.0) / std::sqrt(kRounds / 4.0));
  }
  return worst;
}

// 16 000 frequencies of a fair coin exceed 6 standard errors with probability 1 / 30 000.
TEST(StateHash, EntityHashAvalanche) {
  const auto of = [](const std::array<std::uint64_t, 4>& w, int bit) {
    std::array<std::uint64_t, 4> v = w;
    if (bit >= 0) v[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << bit % 64;
    return entity_hash(HashDomain::kBody, 17, {v[0], v[1], v[2], v[3]});
  };
  EXPECT_LT(worst_avalanche(256, of), 6);
}

TEST(StateHash, EntityHashAvalancheFromZeros) {
  // Real fields are not random: mostly zeros and small counts.
  const auto of = [](const std::array<std::uint64_t, 4>& w, int bit) {
    std::array<std::uint64_t, 2> v = {w[0] & 0xff, 0};
    if (bit >= 0) v[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << bit % 64;
    return entity_hash(HashDomain::kProgram, static_cast<std::uint32_t>(w[1] & 0xfff), {v[0], 0, v[1]});
  };
  EXPECT_LT(worst_avalanche(128, of), 6);
}

TEST(StateHash, IdAndDomainAvalanche) {
  const auto of = [](const std::array<std::uint64_t, 4>& w, int bit) {
    auto id = static_cast<std::uint32_t>(w[0] & 0xfff);
    std::uint64_t domain = 1 + (w[1] & 3);
    if (bit >= 32)
      domain ^= std::uint64_t{1} << (bit - 32);
    else if (bit >= 0)
      id ^= std::uint32_t{1} << bit;
    return entity_hash(static_cast<HashDomain>(domain), id, {w[2]});
  };
  EXPECT_LT(worst_avalanche(35, of), 6);
}

TEST(StateHash, ChainAvalanche) {
  const auto of = [](const std::array<std::uint64_t, 4>& w, int bit) {
    std::array<std::uint64_t, 4> v = w;
    if (bit >= 0) v[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << bit % 64;
    return hash_chain(v[0], v[1]);
  };
  EXPECT_LT(worst_avalanche(128, of), 6);
}

TEST(StateHash, ChainPreservesDifferences) {
  // The chain is a bijection of either argument: 2^16 neighbouring values stay distinct for any other argument.
  std::mt19937_64 random(4);
  for (const std::uint64_t fixed : {std::uint64_t{0}, ~std::uint64_t{0}, random(), random()}) {
    std::set<std::uint64_t> from_previous, from_sum;
    for (std::uint64_t i = 0; i < 1u << 16; ++i) {
      from_previous.insert(hash_chain(i << 48 | i, fixed));
      from_sum.insert(hash_chain(fixed, i << 40));
    }
    EXPECT_EQ(from_previous.size(), 1u << 16);
    EXPECT_EQ(from_sum.size(), 1u << 16);
  }
}

TEST(StateHash, NoWordErasesEarlierWords) {
  // A multiplication by zero would erase them: for every state there would be such a word. The words most likely to have that
  // effect are the id and words close to it.
  EXPECT_NE(entity_hash(HashDomain::kBody, 5, {5, 1}), entity_hash(HashDomain::kRadio, 5, {5, 1}));
  std::set<std::uint64_t> seen;
  for (std::uint32_t id = 0; id < 256; ++id) {
    for (std::uint64_t first = 0; first < 64; ++first) {
      for (std::uint64_t second = 0; second < 16; ++second) {
        seen.insert(entity_hash(HashDomain::kRadio, id, {first, second}));
      }
    }
  }
  EXPECT_EQ(seen.size(), 256u * 64 * 16);
}

TEST(StateHash, OrderNumberAndPositionOfWordsMatter) {
  std::set<std::uint64_t> seen;
  std::size_t cases = 0;
  const auto add = [&](std::uint64_t h) {
    seen.insert(h);
    ++cases;
  };
  for (std::uint32_t id = 0; id < 300; ++id) {
    for (const HashDomain domain :
         {HashDomain::kBody, HashDomain::kProgram, HashDomain::kRadio, HashDomain::kStation}) {
      add(entity_hash(domain, id, {}));
      add(entity_hash(domain, id, {0}));
      add(entity_hash(domain, id, {0, 0}));
      add(entity_hash(domain, id, {1, 2}));
      add(entity_hash(domain, id, {2, 1}));
      add(entity_hash(domain, id, {hash_bits(1.0)}));
      add(entity_hash(domain, id, {hash_bits(-1.0)}));
      add(entity_hash(domain, id, {hash_bits(-1.0), hash_bits(-1.0)}));
      add(entity_hash(domain, id, {hash_bits(1.0), hash_bits(-1.0)}));
      add(entity_hash(domain, id, {hash_bits(1.0), hash_bits(1.0)}));
    }
  }
  EXPECT_EQ(seen.size(), cases);
}

TEST(StateHash, ExchangedFieldsOfTwoRobotsChangeTheSum) {
  const auto sum = [](double a, double b) {
    return entity_hash(HashDomain::kBody, 1, {hash_bits(a)}) + entity_hash(HashDomain::kBody, 2, {hash_bits(b)});
  };
  EXPECT_NE(sum(1, 2), sum(2, 1));
  EXPECT_NE(sum(1, 2), sum(1 + 1e-15, 2));
}

TEST(StateHash, MinusZeroIsZero) {
  EXPECT_EQ(hash_bits(-0.0), 0u);
  EXPECT_EQ(hash_bits(0.0), 0u);
  EXPECT_EQ(hash_bits(-1.5), 0xbff8000000000000u);
  EXPECT_EQ(hash_bits(std::numeric_limits<double>::denorm_min()), 1u);
}

TEST(StateHash, EveryOctetMatters) {
  std::set<std::uint64_t> seen;
  std::string bytes;
  for (int i = 0; i < 40; ++i) {
    seen.insert(hash_bytes(bytes));
    bytes.push_back('\0');
  }
  EXPECT_EQ(seen.size(), 40u);
  const std::string text = "a manifest of some length";
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string other = text;
    other[i] = static_cast<char>(other[i] ^ static_cast<char>(0x80));
    seen.insert(hash_bytes(other));
  }
  EXPECT_EQ(seen.size(), 40 + text.size());
}

TEST(StateHash, GoldenValues) {
  // Recordings contain these values: a change of them changes the format of recordings.
  EXPECT_EQ(entity_hash(HashDomain::kBody, 0, {}), 0x0543679098986549u);
  EXPECT_EQ(entity_hash(HashDomain::kRadio, 7, {hash_bits(12.5), hash_bits(-3), 42}), 0xc2874eff4220f895u);
  EXPECT_EQ(hash_chain(0, 0x0123456789abcdefu), 0x6d8b8688be5302a9u);
  EXPECT_EQ(hash_bytes("kilotwin"), 0x0e467021b547c737u);
}

}  // namespace
}  // namespace kilotwin
