/// Settings of the physics engine. Physics in idl/experiment.proto gives meaning, units and defaults.
#pragma once

#include <cstdint>

namespace kilotwin {

struct PhysicsSettings {
  enum class Engine : std::uint8_t { kPlanar, kKinematic, kOde };
  Engine engine = Engine::kPlanar;
  std::uint32_t sub_steps = 0;
  double tilt_deg = 0, downhill_deg = 0;
  double thrust_N = 0;
  double robot_mass_g = 0, robot_friction = 0, rim_friction = 0;
};

}  // namespace kilotwin
