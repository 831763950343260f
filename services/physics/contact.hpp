/// Planar contact: discs, movable bodies, obstacles and walls. docs/physics.md states the mechanics.
///
/// Kilobots are quasi-static: thrust is limited and ground friction decides. The ground holds a driven robot to the velocity w
/// of its drive with a force of at most the thrust F, and a resting one to velocity 0 with friction x mass x g. A contact is a
/// force along the normal n, kept from tick to tick. In each of S sub-steps, all from the state at its start (Jacobi):
///   contact  f <- max(0, f + gain (closing - kEase max(0, gap - touch)))     closing: of the velocities, carried on
///   friction h <- clamp(h + gain sliding, -friction f, friction f)       sliding: of two robots' rims, turning included
///   robot    slip <- shrink(slip - sum of (f n + h t) / m, F / m), v = w + slip   shrink(s, b): s shorter by b, or 0
///   position moves by v, limited to half of each gap, so that no overlap arises whatever the forces are on their way to be
/// In equilibrium each contact carries the force that keeps the two from closing, and each robot's contacts add up to at most
/// its grip: forces add up along chains, and below the threshold of friction the velocity is 0 and not small. Gains are below
/// what makes the iteration (primal-dual, of Chambolle and Pock) converge whatever touches whatever.
///
/// The normal of a pair stays that of the tick's start within the tick, and the gap is measured along it, never more than the
/// true one. The limit: the excess along n is taken off and the tangential part stays, for the two limits that are missed
/// most; where others are still missed then, all of the rest is scaled down. A body that overlaps from the start moves out of
/// it at up to kSeparation_mm_s and may press into others up to half of its own deepest overlap: overlaps spread and vanish.
///
/// A body depends on its neighbours only: one hop per sub-step; a movable body is one hop however large. So of the bodies of
/// other partitions only those are computed that own ones reach by contacts, and one that is h hops away only in the first
/// S - h sub-steps.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/pose.hpp"
#include "core/experiment/plan.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/contact_pass.hpp"
#include "services/physics/contact_state.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/movable_pass.hpp"

namespace kilotwin::physics {

/// Overlapping bodies move apart at most at this speed each, mm/s: the speed of a wheel at the calibrated turn.
inline constexpr double kSeparation_mm_s = 20;
/// An overlap below this is rounding and is left alone, mm.
inline constexpr double kOverlapTolerance_mm = 5e-10;

/// What is fixed for a run.
struct ContactLimits {
  ContactLimits(const RunPlan&, const DriveModel&);

  std::uint32_t sub_steps;
  double separation_mm;  ///< of an overlapping body per sub-step
  double stride_mm;      ///< no body moves further in a sub-step
  double cutoff_mm;      ///< bodies whose centres are farther apart at the tick's start cannot meet within the tick
  double
      margin_mm;  ///< from a partition's rectangle: all that can matter within a tick, and where bodies can get to
  double x_limit_mm, y_limit_mm;  ///< the centre of a disc stays within +-limit
  double touch_mm;      ///< a contact carries force up to this gap: who follows another at full speed keeps it
  double rim_friction;  ///< between two robots
  double thrust_mm, hold_mm;  ///< grip of a driven and of a resting robot, as contact_state.hpp has forces

  [[nodiscard]] bool outside(double x_mm, double y_mm) const;
};

/// A tick is find(), then the drives of those that ask for one, then move().
class ContactSolver {
 public:
  ContactSolver(const RunPlan&, const DriveModel&);

  /// What contact keeps; per robot of the swarm, and per movable body.
  [[nodiscard]] std::vector<Press>& presses() { return presses_; }
  [[nodiscard]] const std::vector<Press>& presses() const { return presses_; }
  [[nodiscard]] std::vector<MovableState>& movables() { return movables_; }
  [[nodiscard]] const std::vector<MovableState>& movables() const { return movables_; }

  /// Finds who may touch whom. `own`: per body, whether its next pose is asked for; empty: of all. `own_movable`: the same
  /// per movable body. `driven`: per body, 1: it moves by itself. False: everything rests.
  bool find(const Bodies&, const std::vector<std::uint8_t>& own, const std::vector<std::uint8_t>& own_movable,
            const std::vector<std::uint8_t>& driven);
  /// Whether the drive of this driven body can matter.
  [[nodiscard]] bool asks_drive(std::uint32_t body) const {
    return hops_[body] != kOutOfReach && driven_[body] != 0;
  }
  /// The part of a tick over which its drive is to be integrated: a sub-step where it may meet others, else all of it.
  [[nodiscard]] double drive_part(std::uint32_t body) const {
    return seat_of_[body] != ContactPass::kStill ? sub_step_part_ : 1;
  }
  /// Moves the own bodies by one tick and advances their headings; others keep their poses. Own bodies that moved, overlap
  /// or are outside the arena are awake afterwards.
  void move(Bodies&, const Drives&);

  [[nodiscard]] const ContactLimits& limits() const { return limits_; }

 private:
  static constexpr std::uint8_t kOutOfReach = 255;
  /// Bodies with more contacts than this are not told apart.
  static constexpr std::uint32_t kMostContacts = 7;

  /// A body that may be moved by contacts, or whose drive moves one.
  struct Mover {
    std::uint32_t body, first, contacts;  ///< into others_
  };

  /// A contact of a robot with what is no disc.
  struct Special {
    std::uint32_t body, key;    ///< key: as Press::other
    std::uint32_t movable;      ///< or kNone: nothing moves it
    double normal_x, normal_y;  ///< from the robot
    double gap_mm, gain, push_mm;
    double lever_x_mm, lever_y_mm;  ///< of the touched point from the movable body's centre
    ContactPass::Seat seat;
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  [[nodiscard]] bool may_be_touched(std::uint32_t body) const;
  void search(const Bodies&, std::uint32_t body);
  void search_movable(std::uint32_t movable);
  void find_specials(const Bodies&);
  void add_special(std::uint32_t body, std::uint32_t key, std::uint32_t movable, const Nearest& of_shape);
  [[nodiscard]] std::pair<const Special*, const Special*> specials_of(std::uint32_t body) const;
  struct Forces {
    double push_mm = 0, rub_mm = 0;
  };
  [[nodiscard]] Forces forces_of(const Bodies&, std::uint32_t body, std::uint32_t other) const;
  void reach(std::uint32_t node, std::uint8_t hops);
  [[nodiscard]] bool keep_press(const Bodies&, const Mover&);
  void seat_movers();
  void fill_contacts(const Bodies&);
  void fill_contacts(const Bodies&, const ContactPass::Batch&, const Mover* movers);
  /// Where bodies are in the same place, which for one and the same body means that the lane has no such contact.
  void fill_special(ContactPass::Contact&, const Lanes& distance_mm, const std::uint32_t* here,
                    const std::uint32_t* there, const std::uint32_t* entry) const;
  void move_alone(Bodies&, std::uint32_t body, double way_x_mm, double way_y_mm) const;
  void place(Bodies&, std::uint32_t body, double to_x_mm, double to_y_mm) const;

  ContactLimits limits_;
  double sub_step_part_;
  CandidateList candidates_;
  ContactPass pass_;
  std::vector<Mover> movers_, seated_;  ///< by hops; by seats
  std::vector<std::uint32_t> others_;   ///< the contacts of the movers
  std::size_t other_count_ = 0;
  bool any_overlap_ = false, has_others_ = false;
  const World world_;
  std::vector<std::uint8_t> immobile_;  ///< per robot
  std::vector<Press> presses_;
  std::vector<MovableState> movables_;
  MovablePass movable_pass_;
  std::vector<Special> specials_;                     ///< by body, then by key
  std::vector<std::vector<std::uint32_t>> touching_;  ///< per movable body, indices into specials_
  std::vector<std::uint8_t> lively_movable_, has_special_;
  // Per body.
  std::vector<std::uint8_t> hops_;  ///< by contacts from the own bodies, or kOutOfReach
  std::vector<std::uint8_t> driven_, active_, overlaps_, lively_;  ///< lively: driven or pressed
  std::vector<ContactPass::Seat> seat_of_;
  std::vector<std::uint32_t> reached_;  ///< others' bodies, by hops
};

}  // namespace kilotwin::physics
