/// Where a scalar variable lies in robots' memories, and what its octets mean.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace kilotwin {

namespace proto {
class VariablePlace;
}

/// Memories of robots, as their programs see them.
class ProgramMemory {
 public:
  virtual ~ProgramMemory() = default;
  /// Copies octets from an address of the program's debug information. Returns false where the robot has no memory now, or none
  /// there.
  [[nodiscard]] virtual bool read(std::uint32_t robot, std::uint64_t address, std::span<std::uint8_t> to) const = 0;
  /// The address, as read() takes it, to which a pointer in the robot's memory points.
  [[nodiscard]] virtual std::uint64_t address_of(std::uint32_t robot, std::uint64_t pointer) const = 0;
};

class VariablePlace {
 public:
  /// Numbers that are out of range are limited.
  explicit VariablePlace(const proto::VariablePlace& from);

  /// Where the value lies in the memory of this robot; nothing behind a pointer that is null or cannot be read.
  [[nodiscard]] std::optional<std::uint64_t> address(std::uint32_t robot, const ProgramMemory& memory) const;
  /// The octets of the variable, low octet first; nothing where the robot has no memory there.
  [[nodiscard]] std::optional<std::uint64_t> fetch(std::uint32_t robot, const ProgramMemory& memory) const;

  /// Octets as a whole number, or as a number.
  [[nodiscard]] std::int64_t whole(std::uint64_t raw) const;
  [[nodiscard]] double number(std::uint64_t raw) const;
  /// The octets `raw` with the value in its place. Nothing where the variable cannot hold it: beyond its range, a fraction in an
  /// integer, no number.
  [[nodiscard]] std::optional<std::uint64_t> with(double value, std::uint64_t raw) const;
  [[nodiscard]] std::uint8_t octets() const { return octets_; }

 private:
  enum class Kind : std::uint8_t { kSigned, kUnsigned, kFloat };
  [[nodiscard]] unsigned width() const { return bits_ != 0 ? bits_ : octets_ * 8u; }

  std::uint64_t address_, pointer_;
  std::uint8_t octets_, pointer_octets_, bit_offset_, bits_;
  Kind kind_;
};

}  // namespace kilotwin
