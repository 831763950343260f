#include "core/observations/variable_place.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

/// Octets as an unsigned number, low octet first, as on x86-64 and on the AVR.
std::uint64_t joined(std::span<const std::uint8_t> octets) {
  std::uint64_t value = 0;
  for (std::size_t i = octets.size(); i-- > 0;) value = value << 8 | octets[i];
  return value;
}

std::uint64_t lowest(std::uint64_t value, unsigned bits) {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

}  // namespace

VariablePlace::VariablePlace(const proto::VariablePlace& from)
    : address_(from.address()),
      pointer_(from.pointer()),
      octets_(static_cast<std::uint8_t>(std::clamp(from.octets(), 1u, 8u))),
      pointer_octets_(static_cast<std::uint8_t>(std::min(from.pointer_octets(), 8u))),
      bit_offset_(static_cast<std::uint8_t>(std::min(from.bit_offset(), 63u))),
      bits_(static_cast<std::uint8_t>(std::min(from.bits(), 64u))),
      kind_(static_cast<Kind>(from.kind())) {}

std::optional<std::uint64_t> VariablePlace::address(std::uint32_t robot, const ProgramMemory& memory) const {
  if (pointer_octets_ == 0) return address_;
  std::array<std::uint8_t, 8> octets{};
  const std::span pointer(octets.data(), pointer_octets_);
  if (!memory.read(robot, pointer_, pointer)) return std::nullopt;
  const std::uint64_t value = joined(pointer);
  if (value == 0) return std::nullopt;
  return address_ + memory.address_of(robot, value);
}

std::optional<std::uint64_t> VariablePlace::fetch(std::uint32_t robot, const ProgramMemory& memory) const {
  std::array<std::uint8_t, 8> octets{};
  const std::span value(octets.data(), octets_);
  const std::optional<std::uint64_t> at = address(robot, memory);
  if (!at || !memory.read(robot, *at, value)) return std::nullopt;
  return joined(value);
}

std::int64_t VariablePlace::whole(std::uint64_t raw) const {
  const unsigned bits = width();
  const std::uint64_t value = lowest(raw >> bit_offset_, bits);
  if (kind_ != Kind::kSigned || bits >= 64 || (value >> (bits - 1) & 1) == 0)
    return static_cast<std::int64_t>(value);
  return static_cast<std::int64_t>(value | ~std::uint64_t{0} << bits);
}

double VariablePlace::number(std::uint64_t raw) const {
  if (kind_ != Kind::kFloat) return static_cast<double>(whole(raw));
  if (octets_ == 4) return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
  return std::bit_cast<double>(raw);
}

std::optional<std::uint64_t> VariablePlace::with(double value, std::uint64_t raw) const {
  if (kind_ == Kind::kFloat) {
    if (octets_ == 4) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return std::bit_cast<std::uint64_t>(value);
  }
  const unsigned bits = width();
  const double least = kind_ == Kind::kSigned ? -std::ldexp(1, static_cast<int>(bits) - 1) : 0;
  const double beyond = std::ldexp(1, static_cast<int>(bits) - (kind_ == Kind::kSigned ? 1 : 0));
  if (!(value >= least) || !(value < beyond) || value != std::floor(value)) return std::nullopt;
  const std::uint64_t number =
      value < 0 ? static_cast<std::uint64_t>(static_cast<std::int64_t>(value)) : static_cast<std::uint64_t>(value);
  const std::uint64_t mask = lowest(~std::uint64_t{0}, bits) << bit_offset_;
  return (raw & ~mask) | ((number << bit_offset_) & mask);
}

}  // namespace kilotwin
