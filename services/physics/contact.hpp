/// Planar contact: discs, movable bodies, obstacles and walls. docs/explanation/contact.md states the mechanics.
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
/// it at up to kSeparation_mm_s and may move into others up to half of its own deepest overlap: overlaps spread and vanish.
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
#include "core/plan/plan.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/contact_limits.hpp"
#include "services/physics/contact_pass.hpp"
#include "services/physics/contact_state.hpp"
#include "services/physics/drive.hpp"
#include "services/physics/movable_pass.hpp"

namespace kilotwin::physics {

/// A tick is find(), then the drives of those that ask for one, then move().
///
/// Lanes are warm-started: slots of bodies, their neighbours and impulses persist until a robot has moved by half of the skin.
/// That holds where one partition has all robots, and only discs and straight walls are there. Contacts that the skin adds are
/// beyond the cutoff and do nothing, so that no result depends on when slots were assigned. Otherwise, and while discs overlap,
/// slots are assigned in each tick: discs that overlap may have more contacts than the cache holds.
class ContactSolver {
 public:
  ContactSolver(const RunPlan&, const DriveModel&);

  /// What contact keeps; per robot of the swarm, and per movable body.
  [[nodiscard]] ContactCache& cache() {
    release_slots();
    return cache_;
  }
  [[nodiscard]] const ContactCache& cache() const {
    store_cache();
    return cache_;
  }
  /// Sum of the hashes of what contact keeps of these robots.
  [[nodiscard]] std::uint64_t hash_contacts(const std::vector<std::uint32_t>& robots) const;
  [[nodiscard]] std::vector<MovableState>& movables() { return movables_; }
  [[nodiscard]] const std::vector<MovableState>& movables() const { return movables_; }

  /// Finds who may touch whom. `own`: per body, whether its next pose is asked for; empty: of all. `own_movable`: the same
  /// per movable body. `driven`: per body, 1: it moves by itself. False: everything rests.
  bool find(const Bodies&, const std::vector<std::uint8_t>& own, const std::vector<std::uint8_t>& own_movable,
            const std::vector<std::uint8_t>& driven);
  /// Per body, 1: it is driven, and its drive can matter.
  [[nodiscard]] const std::vector<std::uint8_t>& asks_drive() const { return has_others_ ? asked_ : driven_; }
  /// The part of a tick over which drives are to be integrated: a sub-step.
  [[nodiscard]] double drive_part() const { return sub_step_part_; }
  /// Moves the own bodies by one tick and advances their headings; poses of others are of no use afterwards. Own bodies that
  /// moved, overlap or are outside the arena are awake afterwards. Spreads the drives.
  void move(Bodies&, Drives&);

  [[nodiscard]] const ContactLimits& limits() const { return limits_; }

 private:
  static constexpr std::uint8_t kOutOfReach = 255;
  /// Bodies with more contacts than this are not told apart.
  static constexpr std::uint32_t kMostContacts = 7;
  static_assert(kMostContacts < CachedContacts::kMost);

  /// A body that may be moved by contacts or walls, or whose drive moves one.
  struct Mover {
    std::uint32_t body, first, contacts;  ///< into others_
    std::uint32_t near;                   ///< how many are within the cutoff; they come first
  };

  /// A contact of a robot with what is no disc.
  struct Special {
    std::uint32_t body, key;    ///< key: as CachedContacts::other
    std::uint32_t movable;      ///< or kNone: nothing moves it
    double normal_x, normal_y;  ///< from the robot
    double gap_mm, gain, normal_impulse_mm;
    double lever_x_mm, lever_y_mm;  ///< of the touched point from the movable body's centre
    Slot slot;
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  // contact.cpp: the tick.
  void begin(const Bodies&, const BodyColumns&);
  void end(Bodies&);
  [[nodiscard]] bool stays(const ContactBatch&, std::size_t lane) const;
  void remember_forces(ContactBatch&);
  void keep_most(const ContactBatch&);

  // contact_search.cpp: who may touch whom.
  void search_all(const Bodies&, const std::vector<std::uint8_t>& own,
                  const std::vector<std::uint8_t>& own_movable);
  void search(const Bodies&, std::uint32_t body);
  void search_movable(std::uint32_t movable);
  void reach(std::uint32_t node, std::uint8_t hops);
  void reach_beside(std::uint32_t movable, std::uint8_t hops);
  [[nodiscard]] bool may_be_touched(std::uint32_t body) const;

  // contact_specials.cpp: contacts with what is no disc.
  void find_specials(const Bodies&);
  void add_special(std::uint32_t body, std::uint32_t key, std::uint32_t movable, const Nearest& of_shape);
  [[nodiscard]] std::pair<const Special*, const Special*> specials_of(std::uint32_t body) const;
  void fill_specials(std::size_t lane, const Mover&, ContactBatch&);

  // contact_cache.cpp: which body works in which lane.
  void update_slots(const Bodies&);
  void list_near(const Bodies&, std::uint32_t body);
  void assign_slots();
  void assign_point_slots();
  void fill_batches(const Bodies&, double more_mm, bool warm_start);
  void fill_lane(const Bodies&, std::size_t lane, const Mover&, ContactBatch&);
  void warm_start_lane(std::size_t lane, const Mover&, ContactBatch&);
  void order_contacts(const ContactBatch&);
  void fill_rest(std::size_t lane, const Mover&, ContactBatch&);
  void part_lane(const Bodies&, std::size_t lane, const ContactBatch&, ContactLanes*) const;
  bool store_contacts(std::uint32_t robot, const Mover&) const;
  void store_cache() const;
  void release_slots();
  void rest_who_can();

  ContactLimits limits_;
  PassLimits pass_limits_;
  double sub_step_part_;
  CandidateList candidates_;
  ContactPass pass_;
  std::vector<Mover> movers_, slot_movers_;  ///< by hops; by slots
  std::vector<std::uint32_t> others_;        ///< the contacts of the movers
  std::size_t other_count_ = 0;
  bool any_overlap_ = true, has_others_ = false;
  std::size_t active_count_ = 0;
  const World world_;
  bool has_immobile_ = false;
  bool has_shapes_;                     ///< anything but robots and straight walls
  std::vector<std::uint8_t> immobile_;  ///< per robot
  mutable ContactCache cache_;          ///< out of date while slots are kept, until it is read
  mutable bool cache_is_current_ = true;
  std::vector<MovableState> movables_;
  MovablePass movable_pass_;
  std::vector<Special> specials_;                     ///< by body, then by key
  std::vector<std::vector<std::uint32_t>> touching_;  ///< per movable body, indices into specials_
  std::vector<std::uint8_t> lively_movable_, has_special_;
  // Per body.
  std::vector<std::uint8_t> hops_;  ///< by contacts from the own bodies, or kOutOfReach
  std::vector<std::uint8_t> driven_, active_, overlaps_, lively_;  ///< lively: driven, or with cached contacts
  std::vector<Slot> slot_of_;
  std::vector<std::uint8_t> asked_;     ///< driven, and within reach; where there are others
  std::vector<std::uint32_t> reached_;  ///< others' bodies, by hops
  std::vector<std::uint32_t> far_;      ///< scratch
  // While slots are kept.
  std::vector<Slot> previous_slot_of_;  ///< slot_of_ before slots were assigned
  bool slots_are_kept_ = false;
  std::vector<std::uint32_t> slot_robot_;      ///< per body, when slots were assigned
  std::vector<double> slot_x_mm_, slot_y_mm_;  ///< per body, when slots were assigned
  std::vector<double> remembered_;             ///< forces at the tick's start, of batches that may come to rest
};

}  // namespace kilotwin::physics
