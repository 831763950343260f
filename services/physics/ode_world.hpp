/// Rigid bodies and contacts in space, solved by the Open Dynamics Engine. No other file uses ODE's interface. Units are mm,
/// g and s; forces are in g mm/s^2 = 1e-6 N.
///
/// The caller fills a world, steps it and clears it. All state is in RigidState. ODE's code uses only + - * / and square
/// roots here: rotations are integrated to first order and normalised. Worlds of several threads share ODE's random
/// numbers and nothing else; the iterative solver draws them under a lock.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "core/geometry/convex.hpp"

namespace kilotwin::physics {

using Vector3 = std::array<double, 3>;

/// State of a body's centre of mass.
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

  /// Inertia of a homogeneous upright prism with this base, about its centre.
  [[nodiscard]] static Inertia prism(double mass_g, const Convex&, double height_mm);
};

/// A possible contact within the step of two bodies, or of a body with an immobile object: they close by at most the gap.
struct TouchPoint {
  static constexpr std::uint32_t kStanding = 0xffffffff;
  enum class Friction : std::uint8_t {
    kNone,
    kCoulomb,  ///< along each axis, at most `grip` times the normal force
    kBounded,  ///< along each axis, at most `grip` in g mm/s^2, for any normal force
  };

  std::uint32_t body, other;  ///< indices from add(); `other` may be kStanding: immobile
  Vector3 at_mm;              ///< in the arena's frame
  Vector3 normal;             ///< unit, from the other to the body
  double gap_mm;              ///< negative: overlap
  Friction friction = Friction::kNone;
  // Friction along two axes.
  Vector3 axis{};           ///< the first, a unit vector perpendicular to the normal; the second is normal x axis
  double grip[2] = {0, 0};  ///< 0: no friction along this axis
  double motion_mm_s[2] = {0, 0};  ///< target of friction: the body's velocity relative to the other
};

/// Method for the contact forces.
enum class Solver : std::uint8_t {
  kExact,      ///< Dantzig's method; cubic in the number of connected contacts
  kIterative,  ///< successive over-relaxation; linear, slightly soft
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
  /// Advances all bodies and removes all contacts. Results depend on the order of add(); those of the iterative solver also
  /// on `seed`. `pushes`: a movable body is present. Returns false if the exact solver could not determine the forces; the
  /// caller must then discard the states.
  [[nodiscard]] bool step(Solver, std::uint64_t seed, bool pushes);
  void read(std::uint32_t body, RigidState&) const;

 private:
  struct Handles;
  double step_s_;
  std::unique_ptr<Handles> handles_;
};

}  // namespace kilotwin::physics
