/// What contact keeps from tick to tick besides poses. Units of a sub-step: a velocity is a way per sub-step, and a force is
/// the change of a free robot's velocity by it, so that kInertia x robot_mass / sub_step^2 turns it into newtons.
#pragma once

#include <array>
#include <cstdint>

namespace kilotwin::physics {

/// The inertia of all that moves, over its true one. Kilobots are quasi-static: inertia decides nothing, and forces in a jam find
/// their balance the sooner the less of them it takes to stop a body. docs/physics.md has the evidence.
inline constexpr double kInertia = 2;
/// How fast a force ends where a gap opens beyond what a contact bridges, over how fast it ends where bodies part. With 1, a chain
/// of robots hammers on what it pushes, and so moves what its force does not.
inline constexpr double kEase = 0.25;

/// A robot that touches others, or that slips against its drive.
struct Press {
  static constexpr std::size_t kMost = 12;  ///< six equal discs fit around one; the rest is for walls and bodies

  double slip_x_mm = 0, slip_y_mm = 0;  ///< velocity less that of the drive
  std::uint32_t contacts = 0;
  std::array<std::uint32_t, kMost> other{};  ///< ascending: robot, or robots + movable body, or beyond: walls
  std::array<double, kMost> push_mm{};       ///< above 0
  std::array<double, kMost> rub_mm{};        ///< friction, on this robot clockwise about it, on the other likewise

  [[nodiscard]] bool any() const { return contacts != 0 || slip_x_mm != 0 || slip_y_mm != 0; }
  /// Force of the contact with this other; 0 where there is none.
  [[nodiscard]] double push_of(std::uint32_t id) const {
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (other[p] == id) return push_mm[p];
    }
    return 0;
  }
  /// Friction of the contact with this other; 0 where there is none.
  [[nodiscard]] double rub_of(std::uint32_t id) const {
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (other[p] == id) return rub_mm[p];
    }
    return 0;
  }
  bool operator==(const Press& o) const {
    if (slip_x_mm != o.slip_x_mm || slip_y_mm != o.slip_y_mm || contacts != o.contacts) return false;
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (other[p] != o.other[p] || push_mm[p] != o.push_mm[p] || rub_mm[p] != o.rub_mm[p]) return false;
    }
    return true;
  }
};

/// A movable body: pose of its centre and velocity.
struct MovableState {
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  double vx_mm = 0, vy_mm = 0, turn_rad = 0;  ///< per sub-step

  [[nodiscard]] bool moves() const { return vx_mm != 0 || vy_mm != 0 || turn_rad != 0; }
};

}  // namespace kilotwin::physics
