// Every compiler, optimisation level and processor must give the same bits. One constant per function: the hash of its results
// over a fixed set of arguments. A constant changes only with a deliberate change of its function.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"

namespace {

/// Arguments from a 64-bit congruential sequence (Knuth's MMIX): half with random bit patterns, half of usual magnitude.
class Arguments {
 public:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    const std::uint64_t word = state_ ^ state_ >> 29;
    usual_ = !usual_;
    if (!usual_) return std::bit_cast<double>(word);
    return static_cast<double>(static_cast<std::int64_t>(word) >> 11) * 0x1p-43;  // within 2^10
  }

 private:
  std::uint64_t state_ = 0x6b696c6f7477696e;
  bool usual_ = false;
};

constexpr int kCount = 20000;

std::uint64_t hash_of(double (*f)(double), double scale = 1) {
  Arguments arguments;
  kilotwin::HashState state(0);
  for (int i = 0; i < kCount; ++i) state.add(std::bit_cast<std::uint64_t>(f(arguments.next() * scale)));
  return state.finish();
}

std::uint64_t hash_of(double (*f)(double, double)) {
  Arguments arguments;
  kilotwin::HashState state(0);
  for (int i = 0; i < kCount; ++i) {
    const double a = arguments.next(), other = arguments.next(), b = arguments.next(), last = arguments.next();
    state.add(std::bit_cast<std::uint64_t>(f(a, b)));
    state.add(std::bit_cast<std::uint64_t>(f(a, last)));
    state.add(std::bit_cast<std::uint64_t>(f(other, last)));
  }
  return state.finish();
}

TEST(Bits, AreTheSameForEveryCompiler) {
  EXPECT_EQ(hash_of(kt_sin), 0x12ef8dc8d712391cu);
  EXPECT_EQ(hash_of(kt_cos), 0xcd5b017bfeae48f1u);
  EXPECT_EQ(hash_of(kt_tan), 0x0228b4d3c5ca626bu);
  EXPECT_EQ(hash_of(kt_atan), 0xffc9a7706b7be68bu);
  EXPECT_EQ(hash_of(kt_asin, 0x1p-10), 0x43672f15766d76dbu);
  EXPECT_EQ(hash_of(kt_acos, 0x1p-10), 0xe44d6c2ad3b67d55u);
  EXPECT_EQ(hash_of(kt_exp), 0xdc60ee8407bb8623u);
  EXPECT_EQ(hash_of(kt_log), 0x04dc28f002b54ff7u);
  EXPECT_EQ(hash_of(kt_floor), 0x6fc266316913f60du);
  EXPECT_EQ(hash_of([](double x) { return kt_inverse_normal(0.5 + x); }, 0x1p-11), 0x6df89c3916e9ea35u);
  EXPECT_EQ(hash_of([](double x) { return kt_inverse_normal(x); }, 0x1p-14), 0x118823c9be91fdbeu);
  EXPECT_EQ(hash_of(kt_atan2), 0xf1eb623043251dd7u);
  EXPECT_EQ(hash_of(kt_pow), 0x8086e3302784d39bu);
  EXPECT_EQ(hash_of([](double x, double y) { return kt_pow(x < 0 ? -x : x, y * 0x1p-4); }), 0xd2b1dec420d4cbafu);
  EXPECT_EQ(hash_of(kt_fmod), 0x7850e5d3b08a714bu);
  EXPECT_EQ(hash_of(kt_hypot), 0x7318cf24a81d775du);
}

}  // namespace
