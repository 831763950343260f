/// Typed ids: an index of one kind cannot be used for another.
#pragma once

#include <compare>
#include <cstdint>

namespace kilotwin {

template <class Tag> class Id {
 public:
  constexpr Id() = default;
  constexpr explicit Id(std::uint32_t value) : value_(value) {}
  [[nodiscard]] constexpr std::uint32_t value() const { return value_; }
  constexpr auto operator<=>(const Id&) const = default;

 private:
  std::uint32_t value_ = 0;
};

using RobotId = Id<struct RobotTag>;          ///< 0..N-1 over all groups; also the robot's kilo_uid
using PartitionId = Id<struct PartitionTag>;  ///< row * columns + column
using HostId = Id<struct HostTag>;            ///< 0..hosts-1
using FederateId = Id<struct FederateTag>;    ///< index in the plan: partitions, radio, station, hosts

/// State of a robot, numbered as in kilolib. Two values are Kilotwin's own: FLAT, and FAILED: the robot's
/// program faulted in simulation.
enum class LifeCycle : std::uint8_t {
  kSleeping = 0,
  kIdle = 1,
  kBattery = 2,
  kSetup = 3,
  kRunning = 4,
  kCharging = 5,
  kMoving = 6,
  kAbsent = 253,  ///< a tracked robot that is not there
  kFlat = 254,    ///< off because its battery is empty
  kFailed = 255
};

}  // namespace kilotwin
