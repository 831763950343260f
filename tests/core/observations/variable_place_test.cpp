// Values of scalar variables: what is written is read, and nothing beside it changes.
#include "core/observations/variable_place.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

VariablePlace place(unsigned octets, proto::VariablePlace::Kind kind, unsigned bit_offset = 0, unsigned bits = 0) {
  proto::VariablePlace made;
  made.set_octets(octets);
  made.set_kind(kind);
  made.set_bit_offset(bit_offset);
  made.set_bits(bits);
  return VariablePlace(made);
}

TEST(VariablePlace, IntegersHoldTheirRangeAndNothingElse) {
  std::mt19937_64 random(4);
  for (const unsigned octets : {1u, 2u, 4u}) {
    for (const bool is_signed : {true, false}) {
      const VariablePlace at =
          place(octets, is_signed ? proto::VariablePlace::SIGNED : proto::VariablePlace::UNSIGNED);
      const double most = std::ldexp(1, static_cast<int>(8 * octets - (is_signed ? 1 : 0))) - 1;
      const double least = is_signed ? -most - 1 : 0;
      for (const double value : {least, most, 0.0, 1.0, std::floor(most / 3)}) {
        const auto raw = at.with(value, random());
        ASSERT_TRUE(raw) << octets << " octets, " << value;
        EXPECT_EQ(at.number(*raw), value);
      }
      for (const double value : {least - 1, most + 1, 0.5, 1e300, std::numeric_limits<double>::infinity(),
                                 std::numeric_limits<double>::quiet_NaN()})
        EXPECT_FALSE(at.with(value, 0)) << octets << " octets, " << value;
    }
  }
}

TEST(VariablePlace, BitFieldsLeaveTheirNeighboursAlone) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    const auto below = [&random](unsigned count) { return static_cast<unsigned>(random() % count); };
    const unsigned octets = 1 + below(4), bits = 1 + below(8 * octets), bit_offset = below(8 * octets - bits + 1);
    const bool is_signed = random() % 2 == 0;
    const VariablePlace at =
        place(octets, is_signed ? proto::VariablePlace::SIGNED : proto::VariablePlace::UNSIGNED, bit_offset, bits);
    const double least = is_signed ? -std::ldexp(1, static_cast<int>(bits) - 1) : 0;
    const double value = least + static_cast<double>(random() % (std::uint64_t{1} << bits));
    const std::uint64_t before = random(), mask = ((std::uint64_t{1} << bits) - 1) << bit_offset;
    const auto after = at.with(value, before);
    ASSERT_TRUE(after);
    EXPECT_EQ(at.number(*after), value);
    EXPECT_EQ(*after & ~mask, before & ~mask);
  }
}

TEST(VariablePlace, FloatsAreRounded) {
  const VariablePlace narrow = place(4, proto::VariablePlace::FLOAT), wide = place(8, proto::VariablePlace::FLOAT);
  for (const double value : {0.1, -1e30, 0.0, 3.5}) {
    EXPECT_EQ(wide.number(*wide.with(value, 0)), value);
    EXPECT_EQ(narrow.number(*narrow.with(value, 0)), static_cast<double>(static_cast<float>(value)));
  }
}

}  // namespace
}  // namespace kilotwin
