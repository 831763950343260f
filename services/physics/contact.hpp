/// Planar contact: discs, movable bodies, obstacles and walls. docs/explanation/contact.md states the mechanics.
///
/// Kilobots are quasi-static: thrust is limited, and ground friction decides. Let w be the velocity of a robot's drive. The
/// ground holds a driven robot to w with at most the thrust F; it holds a resting robot to velocity 0 with at
/// most its friction times its weight. A contact has an impulse f along its normal n and a friction impulse h along its tangent t; both
/// persist from tick to tick. A tick has S sub-steps. All bodies start a sub-step from the same state (Jacobi):
///   normal   f <- max(0, f + gain (closing - kEase max(0, gap - touch)))   closing: speed from extrapolated velocities
///   tangent  h <- clamp(h + gain sliding, -friction f, friction f)         sliding: relative speed of two rims, with turns
///   robot    slip <- shrink(slip - sum of (f n + h t) / m, F / m)          shrink(u, b): u shortened by b, or 0
///            v = w + slip
///   position moves by v, limited to half of each gap, so that no overlap arises while impulses converge
/// In equilibrium each contact carries the impulse that keeps its two bodies from closing. The impulses on a robot then sum
/// to at most its grip: forces add up along chains, and below the friction threshold a velocity is exactly 0. Gains are
/// below the bound up to which the primal-dual iteration of Chambolle and Pock converges for any arrangement of contacts.
///
/// Within a tick the normal of a pair is that of the tick's start. The gap is measured along it and never exceeds the true
/// gap. Limits apply as follows: for the two most violated limits, the solver removes the excess along n and keeps the
/// tangential part. If other limits are still violated, it scales the whole displacement down. A body that overlaps at the
/// tick's start moves out at up to kSeparation_mm_s. It may enter others by up to half of its own deepest overlap, so that
/// overlaps spread and vanish.
///
/// A body depends on its direct neighbours only: one hop per sub-step. A movable body is one hop, however large. The solver
/// therefore computes only those bodies of other partitions that contacts connect to own ones. It computes a body at h hops
/// only in the first S - h sub-steps.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/pose.hpp"
#include "core/plan/plan.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/contact_limits.hpp"
#include "services/physics/contact_pass.hpp"
#include "services/physics/contact_state.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/movable_pass.hpp"

namespace kilotwin::physics {

/// Order of calls within a tick: find(), then drives for the bodies of needs_drive(), then move().
///
/// Lanes are warm-started: slots of bodies, their neighbours and impulses persist until a robot has moved by half the skin.
/// This requires one partition with all robots, and no shapes but discs and straight walls. Contacts that only the skin adds
/// lie beyond the cutoff and have no effect, so no result depends on when slots were assigned. In all other cases, and while
/// discs overlap, the solver assigns slots in each tick: overlapping discs may have more contacts than the cache holds.
class ContactSolver {
 public:
  ContactSolver(const RunPlan&, const DriveModel&);

  /// Cached contacts per robot of the swarm.
  [[nodiscard]] ContactCache& cache() {
    release_slots();
    return cache_;
  }
  [[nodiscard]] const ContactCache& cache() const {
    store_cache();
    return cache_;
  }
  /// Sum of the hashes of these robots' cached contacts.
  [[nodiscard]] std::uint64_t hash_contacts(const std::vector<std::uint32_t>& robots) const;
  [[nodiscard]] std::vector<MovableState>& movables() { return movables_; }
  [[nodiscard]] const std::vector<MovableState>& movables() const { return movables_; }

  /// Finds the contacts that are possible within the tick. `own`: per body, whether the caller needs its next pose; empty:
  /// all. `own_movable`: the same per movable body. `driven`: per body, 1: its drive moves it. Returns false if all bodies rest.
  bool find(const Bodies&, const std::vector<std::uint8_t>& own, const std::vector<std::uint8_t>& own_movable,
            const std::vector<std::uint8_t>& driven);
  /// Per body, 1: it is driven, and its drive can affect an own body.
  [[nodiscard]] const std::vector<std::uint8_t>& needs_drive() const {
    return has_others_ ? needs_drive_ : driven_;
  }
  /// Fraction of a tick over which drives are to be integrated: one sub-step.
  [[nodiscard]] double drive_part() const { return sub_step_part_; }
  /// Moves the own bodies by one tick and advances their headings. Poses of other bodies are unspecified afterwards. Own
  /// bodies that moved, overlap or are outside the arena become awake. Calls Drives::spread.
  void move(Bodies&, Drives&);

  [[nodiscard]] const ContactLimits& limits() const { return limits_; }

 private:
  static constexpr std::uint8_t kOutOfReach = 255;
  /// Slots are sorted by number of contacts; counts above this one form a single class.
  static constexpr std::uint32_t kMostContacts = 7;
  static_assert(kMostContacts < CachedContacts::kMost);

  /// A body that contacts or walls may move, or whose drive moves a contact partner.
  struct Mover {
    std::uint32_t body, first, contacts;  ///< contacts: others_[first, first + contacts)
    std::uint32_t near;                   ///< number of contacts within the cutoff; they come first
  };

  /// A contact of a robot with a movable body, an obstacle or a curved wall.
  struct Special {
    std::uint32_t body, key;    ///< key: as CachedContacts::other
    std::uint32_t movable;      ///< or kNone: an obstacle or wall
    double normal_x, normal_y;  ///< from the robot
    double gap_mm, gain, normal_impulse_mm;
    double lever_x_mm, lever_y_mm;  ///< from the movable body's centre to the point of contact
    Slot slot;
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  // contact.cpp: the tick.
  void begin(const Bodies&, const BodyColumns&);
  void end(Bodies&);
  [[nodiscard]] bool is_steady(const ContactBatch&, std::size_t lane) const;
  void remember_forces(ContactBatch&);
  void drop_excess_contacts(const ContactBatch&);

  // contact_search.cpp: which bodies can touch.
  void search_all(const Bodies&, const std::vector<std::uint8_t>& own,
                  const std::vector<std::uint8_t>& own_movable);
  void search(const Bodies&, std::uint32_t body);
  void search_movable(std::uint32_t movable);
  void reach(std::uint32_t node, std::uint8_t hops);
  void reach_neighbours(std::uint32_t movable, std::uint8_t hops);
  [[nodiscard]] bool may_be_touched(std::uint32_t body) const;

  // contact_specials.cpp: contacts with shapes other than discs.
  void find_specials(const Bodies&);
  void add_special(std::uint32_t body, std::uint32_t key, std::uint32_t movable, const Nearest& of_shape);
  [[nodiscard]] std::pair<const Special*, const Special*> specials_of(std::uint32_t body) const;
  void fill_specials(std::size_t lane, const Mover&, ContactBatch&);

  // contact_cache.cpp: which body has which lane.
  void update_slots(const Bodies&);
  void list_near(const Bodies&, std::uint32_t body);
  void assign_slots();
  void assign_point_slots();
  void fill_batches(const Bodies&, double more_mm, bool warm_start);
  void fill_lane(const Bodies&, std::size_t lane, const Mover&, ContactBatch&);
  void warm_start_lane(std::size_t lane, const Mover&, ContactBatch&);
  void order_contacts(const ContactBatch&);
  void fill_rest(std::size_t lane, const Mover&, ContactBatch&);
  void separate_lane(const Bodies&, std::size_t lane, const ContactBatch&, ContactLanes*) const;
  bool store_contacts(std::uint32_t robot, const Mover&) const;
  void store_cache() const;
  void release_slots();
  void rest_idle_batches();

  ContactLimits limits_;
  PassLimits pass_limits_;
  double sub_step_part_;
  CandidateList candidates_;
  ContactPass pass_;
  std::vector<Mover> movers_, slot_movers_;  ///< in the order of hops; in the order of slots
  std::vector<std::uint32_t> others_;        ///< contacts of the movers: indices of bodies, then of specials_
  std::size_t other_count_ = 0;
  bool any_overlap_ = true, has_others_ = false;
  std::size_t active_count_ = 0;
  const World world_;
  bool has_immobile_ = false;
  bool has_shapes_;                     ///< there are other shapes than robots and straight walls
  std::vector<std::uint8_t> immobile_;  ///< per robot
  mutable ContactCache cache_;          ///< while slots are kept, filled only when it is read
  mutable bool cache_is_current_ = true;
  std::vector<MovableState> movables_;
  MovablePass movable_pass_;
  std::vector<Special> specials_;                     ///< sorted by body, then by key
  std::vector<std::vector<std::uint32_t>> touching_;  ///< per movable body, indices into specials_
  std::vector<std::uint8_t> movable_in_motion_, has_special_;
  // Per body.
  std::vector<std::uint8_t> hops_;  ///< number of contacts from the nearest own body, or kOutOfReach
  std::vector<std::uint8_t> driven_, active_, overlaps_,
      in_motion_;  ///< in_motion: driven, or with cached contacts
  std::vector<Slot> slot_of_;
  std::vector<std::uint8_t> needs_drive_;  ///< driven, and within reach; used if there are other partitions' bodies
  std::vector<std::uint32_t> reached_;     ///< bodies of other partitions that contacts reach, by hops
  std::vector<std::uint32_t> far_;         ///< scratch
  // While slots are kept.
  std::vector<Slot> previous_slot_of_;  ///< slot_of_ before slots were assigned
  bool slots_are_kept_ = false;
  std::vector<std::uint32_t> slot_robot_;      ///< per body, at the last assignment of slots
  std::vector<double> slot_x_mm_, slot_y_mm_;  ///< per body, at the last assignment of slots
  std::vector<double> remembered_;             ///< impulses at the tick's start, of batches with undriven bodies
};

}  // namespace kilotwin::physics
