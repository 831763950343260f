/// The memories of a host's robots, for whoever reads their variables.
#pragma once

#include "core/observations/variable_place.hpp"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

class HostMemory final : public ProgramMemory {
 public:
  explicit HostMemory(const BehavioursEngine& engine) : engine_(engine) {}
  [[nodiscard]] bool read(std::uint32_t robot, std::uint64_t address, std::span<std::uint8_t> to) const override {
    return engine_.read(robot, address, to);
  }
  [[nodiscard]] std::uint64_t address_of(std::uint32_t robot, std::uint64_t pointer) const override {
    return engine_.offset_of(robot, pointer);
  }

 private:
  const BehavioursEngine& engine_;
};

}  // namespace kilotwin::behaviours
