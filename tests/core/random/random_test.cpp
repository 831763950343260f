// Statistics use fixed seeds, so that the tests are deterministic. Limits are in standard errors. A true generator exceeds 4.5 of
// them once in 150 000 tests. Each limit was set before its seed was tried.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include "core/base/state_hash.hpp"
#include "core/random/random.hpp"

namespace kilotwin {
namespace {

using Block = std::array<std::uint32_t, 4>;
constexpr double kLimit = 4.5;

TEST(Philox, KnownAnswers) {  // Salmon et al., Random123 1.14, kat_vectors.
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
            (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, EveryCoordinateReachesTheCounter) {
  // For one key, Philox is a bijection of the counter: if all blocks differ, all counters differ.
  const Random random(42);
  std::vector<std::tuple<Stream, std::uint32_t, std::int64_t, std::uint32_t>> places{{Stream::kWheelBias, 0, 0, 0}};
  for (unsigned bit = 0; bit < 16; ++bit) places.emplace_back(static_cast<Stream>((1u << bit) ^ 1u), 0, 0, 0);
  for (unsigned bit = 0; bit < 32; ++bit) places.emplace_back(Stream::kWheelBias, 1u << bit, 0, 0);
  for (unsigned bit = 0; bit < 64; ++bit) {
    places.emplace_back(Stream::kWheelBias, 0, static_cast<std::int64_t>(std::uint64_t{1} << bit), 0);
  }
  for (unsigned bit = 0; bit < 16; ++bit) places.emplace_back(Stream::kWheelBias, 0, 0, 1u << bit);
  std::set<Block> blocks;
  for (const auto& [stream, entity, tick, b] : places) blocks.insert(random.block(stream, entity, Tick{tick}, b));
  EXPECT_EQ(blocks.size(), places.size());

  std::set<Block> near;
  for (std::uint16_t stream = 1; stream <= 7; ++stream) {
    for (std::uint32_t entity = 0; entity < 12; ++entity) {
      for (int tick = -3; tick < 12; ++tick) {
        for (std::uint32_t b = 0; b < 12; ++b)
          near.insert(random.block(static_cast<Stream>(stream), entity, Tick{tick}, b));
      }
    }
  }
  EXPECT_EQ(near.size(), 7u * 12 * 15 * 12);
}

TEST(Random, TheWholeSeedIsTheKey) {
  const auto bits_of = [](std::uint64_t seed) { return Random(seed).bits(Stream::kLayout, 1, Tick{2}, 3); };
  std::set<std::uint64_t> seen{bits_of(0)};
  for (unsigned bit = 0; bit < 64; ++bit) seen.insert(bits_of(std::uint64_t{1} << bit));
  EXPECT_EQ(seen.size(), 65u);
}

TEST(Random, DrawsAreHalvesOfBlocks) {
  const Random random(7);
  for (std::uint32_t b = 0; b < 50; ++b) {
    const Tick tick{static_cast<int>(b) * 3};
    const auto words = random.block(Stream::kBackOff, b, tick, b);
    const auto bits = random.bits_pair(Stream::kBackOff, b, tick, b);
    EXPECT_EQ(bits[0], std::uint64_t{words[1]} << 32 | words[0]);
    EXPECT_EQ(bits[1], std::uint64_t{words[3]} << 32 | words[2]);
    const auto uniforms = random.uniform_pair(Stream::kBackOff, b, tick, b);
    const auto normals = random.normal_pair(Stream::kBackOff, b, tick, b);
    for (std::uint32_t half = 0; half < 2; ++half) {
      EXPECT_EQ(random.bits(Stream::kBackOff, b, tick, 2 * b + half), bits[half]);
      EXPECT_EQ(random.uniform(Stream::kBackOff, b, tick, 2 * b + half), uniforms[half]);
      EXPECT_EQ(random.normal(Stream::kBackOff, b, tick, 2 * b + half), normals[half]);
    }
  }
}

TEST(RandomDeathTest, DrawOutOfRangeIsADefect) {
  EXPECT_DEATH(static_cast<void>(Random(1).block(Stream::kLayout, 0, Tick{0}, 0x10000)), "expected b < 0x10000u");
}

TEST(Random, GoldenBits) {
  const Random random(20180901);
  HashState state(0);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    state.add(std::bit_cast<std::uint64_t>(random.uniform(Stream::kReception, i, Tick{i}, i % 7)));
    state.add(std::bit_cast<std::uint64_t>(random.normal(Stream::kWheelFactor, i, Tick{i * 5}, i % 2)));
  }
  EXPECT_EQ(state.finish(), 0x5dcc5511eaeb006fu);
}

/// 2^17 numbers over entities, ticks and draws.
template <class Draw> std::vector<double> sample(const Draw& draw) {
  std::vector<double> values;
  for (std::uint32_t entity = 0; entity < 256; ++entity) {
    for (int tick = 0; tick < 128; ++tick) {
      for (std::uint32_t i = 0; i < 4; ++i) values.push_back(draw(entity, Tick{tick}, i));
    }
  }
  return values;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double mean_a = 0, mean_b = 0, ab = 0, aa = 0, bb = 0;
  const auto n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) mean_a += a[i] / n, mean_b += b[i] / n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

/// Kolmogorov-Smirnov statistic times sqrt(n): exceeds 2.2 once in 8 000 tests.
template <class Distribution>
double kolmogorov_smirnov(std::vector<double> values, const Distribution& distribution) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double distance = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double p = distribution(values[i]);
    distance = std::max({distance, p - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - p});
  }
  return distance * std::sqrt(n);
}

TEST(Random, UniformIsUniform) {
  const Random random(1);
  const auto values = sample([&](auto e, Tick t, auto i) { return random.uniform(Stream::kReception, e, t, i); });
  const auto n = static_cast<double>(values.size());
  double sum = 0;
  std::array<double, 256> cells{};
  for (const double v : values) {
    ASSERT_GT(v, 0);
    ASSERT_LT(v, 1);
    sum += v;
    cells[static_cast<std::size_t>(v * 256)] += 1;
  }
  EXPECT_LT(std::fabs(sum / n - 0.5), kLimit * std::sqrt(1.0 / 12 / n));
  double chi_square = 0;
  for (const double count : cells) chi_square += (count - n / 256) * (count - n / 256) / (n / 256);
  EXPECT_LT(std::fabs(chi_square - 255), kLimit * std::sqrt(2.0 * 255));
  EXPECT_LT(kolmogorov_smirnov(values, [](double v) { return v; }), 2.2);
}

TEST(Random, NormalIsNormal) {
  const Random random(2);
  const auto values = sample([&](auto e, Tick t, auto i) { return random.normal(Stream::kWheelFactor, e, t, i); });
  const auto n = static_cast<double>(values.size());
  std::array<double, 5> moment{};
  for (const double v : values) {
    for (std::size_t k = 1; k < 5; ++k) moment[k] += std::pow(v, static_cast<double>(k)) / n;
  }
  // Variances of v, v^2, v^3, v^4 of a standard normal: 1, 2, 15, 96.
  EXPECT_LT(std::fabs(moment[1]), kLimit * std::sqrt(1 / n));
  EXPECT_LT(std::fabs(moment[2] - 1), kLimit * std::sqrt(2 / n));
  EXPECT_LT(std::fabs(moment[3]), kLimit * std::sqrt(15 / n));
  EXPECT_LT(std::fabs(moment[4] - 3), kLimit * std::sqrt(96 / n));
  EXPECT_LT(kolmogorov_smirnov(values, [](double v) { return std::erfc(-v / std::sqrt(2.0)) / 2; }), 2.2);
}

TEST(Random, DrawsAreIndependentAcrossCoordinates) {
  // Draws that differ in one coordinate are uncorrelated, in value and in distance from the mean.
  const Random random(3), other_seed(4);
  const auto draw = [&](Stream stream, auto e, Tick t, auto i) { return random.uniform(stream, e, t, i); };
  const auto base = sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e, t, i); });
  const std::vector<std::vector<double>> others = {
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kBackOff, e, t, i); }),
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e + 256, t, i); }),
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e ^ 1u, t, i); }),
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e, t + 1, i); }),
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e, t, i ^ 1u); }),
      sample([&](auto e, Tick t, auto i) { return draw(Stream::kReception, e, t, i + 1); }),
      sample([&](auto e, Tick t, auto i) { return other_seed.uniform(Stream::kReception, e, t, i); })};
  const double limit = kLimit / std::sqrt(static_cast<double>(base.size()));
  const auto spread = [](std::vector<double> values) {
    for (double& v : values) v = std::fabs(v - 0.5);
    return values;
  };
  for (std::size_t i = 0; i < others.size(); ++i) {
    // Exchanged neighbours would count each pair twice.
    const double twice = i == 2 || i == 4 ? std::sqrt(2.0) : 1;
    EXPECT_LT(std::fabs(correlation(base, others[i])), twice * limit) << i;
    EXPECT_LT(std::fabs(correlation(spread(base), spread(others[i]))), twice * limit) << i;
  }
}

TEST(Random, EveryBitIsAFairCoin) {
  const Random random(5);
  std::array<int, 64> ones{};
  constexpr int kDraws = 40000;
  for (int tick = 0; tick < kDraws; ++tick) {
    const std::uint64_t bits = random.bits(Stream::kProgram, 0, Tick{tick}, 0);
    for (unsigned bit = 0; bit < 64; ++bit) ones[bit] += static_cast<int>(bits >> bit & 1);
  }
  for (const int count : ones) EXPECT_LT(std::abs(count - kDraws / 2), kLimit * std::sqrt(kDraws / 4.0));
}

}  // namespace
}  // namespace kilotwin
