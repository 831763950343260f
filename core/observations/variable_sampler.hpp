/// VariableSampler: reads recorded variables out of robots' memories at the ticks at which they are due. Nothing that it does
/// affects a result.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/recording_schedule.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

namespace proto {
class Observations;
class VariablePlace;
}  // namespace proto

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

class VariableSampler {
 public:
  /// For the robots of a share that run firmware, or for those that do not.
  VariableSampler(const RunPlan& plan, Share share, bool firmware);

  [[nodiscard]] bool any() const { return !variables_.empty(); }
  /// Adds the variables that are due at `now`.
  void sample(Tick now, const ProgramMemory& memory, proto::Observations& to) const;

 private:
  enum class Kind : std::uint8_t { kSigned, kUnsigned, kFloat };
  struct Place {
    std::uint64_t address = 0, pointer = 0;
    std::uint8_t octets = 0, pointer_octets = 0, bit_offset = 0, bits = 0;
    Kind kind = Kind::kSigned;
  };
  struct Reading {
    std::uint32_t robot = 0, place = 0;  ///< index into places
  };
  struct Variable {
    std::uint32_t index = 0;  ///< in the manifest
    bool integer = false;
    RecordingSchedule schedule;
    std::vector<Place> places;
    std::vector<Reading> readings;  ///< ascending robots
  };
  static Place place_of(const proto::VariablePlace& place);
  static bool fetch(const Place& place, std::uint32_t robot, const ProgramMemory& memory, std::uint64_t& raw);
  static std::int64_t whole(const Place& place, std::uint64_t raw);
  static double number(const Place& place, std::uint64_t raw);

  std::vector<Variable> variables_;
};

}  // namespace kilotwin
