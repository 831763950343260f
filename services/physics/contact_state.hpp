/// State of contact besides poses: it warm-starts the solver. Time is measured in sub-steps, so a velocity is a displacement
/// per sub-step, mm. An impulse is given as the velocity change of a free robot, mm per sub-step; multiply it by
/// kInertia x robot_mass / sub_step^2 to get a force.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin::physics {

/// Contacts and slip of one robot.
struct CachedContacts {
  static constexpr std::size_t kMost =
      12;  ///< six equal discs fit around one; the others are walls and movable bodies
  struct Contact {
    double normal_impulse_mm = 0;   ///< above 0 for a contact
    double tangent_impulse_mm = 0;  ///< friction; positive: clockwise about this robot, and about the other as well
    std::uint32_t other = 0;        ///< robot id; then robots + index of a movable body; larger keys are walls

    bool operator==(const Contact&) const = default;
  };

  double slip_x_mm = 0, slip_y_mm = 0;  ///< velocity minus that of the drive
  std::uint32_t contacts = 0;
  std::array<Contact, kMost> contact{};  ///< ascending by `other`; the first `contacts` are valid

  [[nodiscard]] bool any() const { return contacts != 0 || slip_x_mm != 0 || slip_y_mm != 0; }
  /// The contact with this key; impulses 0 if there is none.
  [[nodiscard]] Contact contact_with(std::uint32_t id) const {
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (contact[p].other == id) return contact[p];
    }
    return {};
  }
};

/// The cached contacts of all robots, with a flag per robot: most robots touch nothing.
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
  /// Calls change(cached) on the robot's entry in place, updates the flag, and returns the call's result.
  template <class Change> bool change(std::size_t robot, Change&& change) {
    const bool result = change(cache_[robot]);
    any_[robot] = cache_[robot].any();
    return result;
  }

 private:
  std::vector<CachedContacts> cache_;
  std::vector<std::uint8_t> any_;
};

/// A movable body: pose of its centre, and velocity.
struct MovableState {
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  double vx_mm = 0, vy_mm = 0, turn_rad = 0;  ///< per sub-step

  [[nodiscard]] bool moves() const { return vx_mm != 0 || vy_mm != 0 || turn_rad != 0; }
};

}  // namespace kilotwin::physics
