#include "core/federation/hash_sums.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/base/state_hash.hpp"

namespace kilotwin {
namespace {

TEST(HashSums, DoesNotDependOnTheOrderOfShares) {
  std::mt19937_64 random(1);
  constexpr std::size_t kFederates = 5, kTicks = 100;
  std::vector<std::vector<std::uint64_t>> shares(kFederates, std::vector<std::uint64_t>(kTicks));
  for (auto& own : shares) std::generate(own.begin(), own.end(), [&] { return random(); });
  std::uint64_t expected = 0;
  for (std::size_t t = 0; t < kTicks; ++t) {
    std::uint64_t sum = 0;
    for (const auto& own : shares) sum += own[t];
    expected = hash_chain(expected, sum);
  }
  for (int round = 0; round < 20; ++round) {
    HashSums book(kFederates, Tick{0}, 0);
    std::vector<std::size_t> sent(kFederates, 0);
    while (book.tick() < Tick{kTicks - 1}) {
      const std::size_t who = random() % kFederates;
      const std::size_t count = std::min<std::size_t>(random() % 9, kTicks - sent[who]);
      ASSERT_TRUE(
          book.add(Tick{static_cast<std::int64_t>(sent[who])}, std::span(shares[who]).subspan(sent[who], count)));
      sent[who] += count;
      while (book.advance()) {}
    }
    EXPECT_EQ(book.chain(), expected);
  }
}

TEST(HashSums, RefusesLateAndSurplusShares) {
  HashSums book(1, Tick{0}, 0);
  const std::uint64_t share[] = {1};
  EXPECT_TRUE(book.add(Tick{0}, share));
  EXPECT_FALSE(book.add(Tick{0}, share));
  EXPECT_TRUE(book.advance());
  EXPECT_FALSE(book.add(Tick{0}, share));
  EXPECT_FALSE(book.advance());
}

TEST(HashSums, ContinuesAResumedChain) {
  const std::uint64_t a[] = {3}, b[] = {4};
  HashSums whole(1, first_hashed(Tick{0}), 0);
  whole.add(Tick{0}, a);
  whole.advance();
  const std::uint64_t at_checkpoint = whole.chain();
  whole.add(Tick{1}, b);
  whole.advance();
  HashSums resumed(1, Tick{1}, at_checkpoint);
  resumed.add(Tick{1}, b);
  resumed.advance();
  EXPECT_EQ(resumed.chain(), whole.chain());
  EXPECT_EQ(first_hashed(Tick{7}), Tick{8});
}

}  // namespace
}  // namespace kilotwin
