/// Rigid bodies and contacts in space, solved by the Open Dynamics Engine. This is the only part that knows ODE. Units mm, g,
/// s: forces come out in g mm/s^2 = 1e-6 N.
///
/// A world is filled, stepped and emptied; nothing stays in it, so that all state is in RigidState. Of ODE's arithmetic
/// only + - * / and square roots are on the path (rotations are integrated to first order and normalised), and worlds
/// of several threads share nothing but ODE's random numbers, which the iterative solver draws under a lock.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/geometry/convex.hpp"

namespace kilotwin::physics {

using Vector3 = std::array<double, 3>;

/// Of a body's centre of mass.
struct RigidState {
  Vector3 position_mm{};
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< unit quaternion w, x, y, z, from the body's frame to the arena's
  Vector3 velocity_mm_s{}, spin_rad_s{};       ///< in the arena's frame
};

/// Mass and moments about the axes of the body's frame.
struct Inertia {
  double mass_g;
  Vector3 moment_g_mm2;
  double product_xy_g_mm2 = 0;

  /// A homogeneous upright prism over the shape, about its centre.
  [[nodiscard]] static Inertia prism(double mass_g, const Convex&, double height_mm);
};

/// Two bodies, or one body and what stands, touch or may touch within the step: they do not close more than the gap.
struct TouchPoint {
  static constexpr std::uint32_t kStanding = 0xffffffff;
  enum class Friction : std::uint8_t {
    kNone,
    kCoulomb,  ///< along each axis at most its grip times the normal force
    kBounded,  ///< along each axis at most its grip in g mm/s^2, whatever the normal force
  };

  std::uint32_t body, other;  ///< indices as add() returned them; `other` may be kStanding
  Vector3 at_mm;              ///< in the arena's frame
  Vector3 normal;             ///< unit, from the other to the body
  double gap_mm;              ///< negative: overlap
  Friction friction = Friction::kNone;
  // Along two axes.
  Vector3 axis{};                  ///< the first: unit, perpendicular to the normal; the second is normal x axis
  double grip[2] = {0, 0};         ///< 0: none along this axis
  double motion_mm_s[2] = {0, 0};  ///< the body's velocity against the other that friction works towards
};

/// How the forces at contacts are found.
enum class Solver : std::uint8_t {
  kExact,      ///< Dantzig's method; its time grows with the cube of the contacts that hang together
  kIterative,  ///< successive over-relaxation; linear time, a little soft
};

class OdeWorld {
 public:
  OdeWorld(Vector3 gravity_mm_s2, double step_s);
  ~OdeWorld();
  OdeWorld(OdeWorld&&) noexcept;

  /// Removes all bodies and contacts.
  void clear();
  std::uint32_t add(const Inertia&, const RigidState&);
  void add(const TouchPoint&);
  /// Advances all bodies and removes all contacts. Results depend on the order of adding, and with the iterative solver on
  /// `seed`. `pushes`: a movable body is among them. False: the exact solver met contacts whose forces it cannot tell apart, and the states are to be dropped.
  [[nodiscard]] bool step(Solver, std::uint64_t seed, bool pushes);
  void read(std::uint32_t body, RigidState&) const;

 private:
  struct Handles;
  double step_s_;
  std::unique_ptr<Handles> handles_;
};

}  // namespace kilotwin::physics
