/// The state of contact besides poses: what the solver is warm-started with. Units of a sub-step: a velocity is a way per
/// sub-step. An impulse is the change of a free robot's velocity by it, so that kInertia x robot_mass / sub_step^2 turns it
/// into newtons.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin::physics {

/// A robot that touches others, or that slips against its drive.
struct CachedContacts {
  static constexpr std::size_t kMost = 12;  ///< six equal discs fit around one; the rest is for walls and bodies
  struct Contact {
    double normal_impulse_mm = 0;   ///< of a contact, above 0
    double tangent_impulse_mm = 0;  ///< friction: on this robot clockwise about it, on the other likewise
    std::uint32_t other = 0;        ///< robot, or robots + movable body, or beyond: walls

    bool operator==(const Contact&) const = default;
  };

  double slip_x_mm = 0, slip_y_mm = 0;  ///< velocity less that of the drive
  std::uint32_t contacts = 0;
  std::array<Contact, kMost> contact{};  ///< ascending by the other; the first `contacts` count

  [[nodiscard]] bool any() const { return contacts != 0 || slip_x_mm != 0 || slip_y_mm != 0; }
  /// The contact with this other; without forces where there is none.
  [[nodiscard]] Contact contact_with(std::uint32_t id) const {
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (contact[p].other == id) return contact[p];
    }
    return {};
  }
};

/// The cached contacts of all robots, and which robots have any: most robots touch nobody.
class ContactCache {
 public:
  explicit ContactCache(std::size_t robots) : cache_(robots), any_(robots, 0) {}

  [[nodiscard]] std::size_t size() const { return cache_.size(); }
  [[nodiscard]] const CachedContacts& operator[](std::size_t robot) const { return cache_[robot]; }
  [[nodiscard]] bool any(std::size_t robot) const { return any_[robot] != 0; }
  void set(std::size_t robot, const CachedContacts& cached) {
    cache_[robot] = cached;
    any_[robot] = cached.any();
  }
  void clear(std::size_t robot) {
    if (any_[robot] == 0) return;
    cache_[robot].slip_x_mm = cache_[robot].slip_y_mm = 0;
    cache_[robot].contacts = 0;
    any_[robot] = 0;
  }
  /// Changes it in place: `change(cached)`, whose result this returns.
  template <class Change> bool change(std::size_t robot, Change&& change) {
    const bool result = change(cache_[robot]);
    any_[robot] = cache_[robot].any();
    return result;
  }

 private:
  std::vector<CachedContacts> cache_;
  std::vector<std::uint8_t> any_;
};

/// A movable body: pose of its centre and velocity.
struct MovableState {
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  double vx_mm = 0, vy_mm = 0, turn_rad = 0;  ///< per sub-step

  [[nodiscard]] bool moves() const { return vx_mm != 0 || vy_mm != 0 || turn_rad != 0; }
};

}  // namespace kilotwin::physics
