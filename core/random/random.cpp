#include "core/random/random.hpp"

#include "core/math/elementary.h"

namespace kilotwin {

double Random::normal(Stream stream, std::uint32_t entity, Tick tick, std::uint32_t draw) const {
  return kt_inverse_normal(uniform(stream, entity, tick, draw));
}

std::array<double, 2> Random::normal_pair(Stream stream, std::uint32_t entity, Tick tick, std::uint32_t b) const {
  const auto pair = uniform_pair(stream, entity, tick, b);
  return {kt_inverse_normal(pair[0]), kt_inverse_normal(pair[1])};
}

}  // namespace kilotwin
