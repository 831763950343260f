/// Planar contact between discs, and between discs and the walls of the arena.
///
/// Within a tick the normal n of a pair stays that of the tick's start, and the gap is measured along it:
///   gap = n . (p_j - p_i) - 2 r,
/// which is never more than the true gap. In each of S sub-steps, all from the positions at its start (Jacobi):
///   wanted  w_i = drive + pushes of neighbours that are driven at body i faster than they can follow it
///                 (n . d_j - max(half of the gap, what i drives away by itself), at most the pusher's own drive)
///                 + for an overlap, half of it away from each other, at most kSeparation_mm_s
///   limited u_i : n . u_i <= half of the gap for every neighbour, the whole gap for walls; the excess along n is taken
///                 off and the tangential part stays, for the two limits that are missed most; where others are still
///                 missed then, all of the rest is scaled down.
/// Both bodies of a pair close at most half of the gap, so no overlap arises, whatever they want, and 0 is always feasible.
/// An overlap that was there from the start (a real robot moved into others, poses given so) would never part in a dense
/// crowd that way. So a body that overlaps may press into others up to half of its own deepest overlap: overlaps spread,
/// get smaller and vanish, and the deepest one never grows.
/// Sums run over neighbours in ascending ids. A body depends on its neighbours only: one hop per sub-step.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/pose.hpp"
#include "core/experiment/plan.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/cell_list.hpp"
#include "services/physics/drive.hpp"

namespace kilotwin::physics {

/// Overlapping bodies move apart at most at this speed each, mm/s: the speed of a wheel at the calibrated turn.
inline constexpr double kSeparation_mm_s = 20;
/// An overlap below this is rounding and is left alone, mm.
inline constexpr double kOverlapTolerance_mm = 5e-10;

/// What is fixed for a run.
struct ContactLimits {
  ContactLimits(const RunPlan&, const DriveModel&);

  std::uint32_t sub_steps;
  double separation_mm;   ///< of an overlapping body per sub-step
  double stride_mm;       ///< no body moves further in a sub-step
  double cutoff_mm;       ///< bodies whose centres are farther apart at the tick's start cannot meet within the tick
  double margin_mm;       ///< from a partition's rectangle: all that can matter within a tick, and where bodies can get to
  double x_limit_mm, y_limit_mm;  ///< the centre of a disc stays within +-limit

  [[nodiscard]] bool outside(double x_mm, double y_mm) const;
};

class ContactSolver {
 public:
  ContactSolver(const RunPlan&, const DriveModel&);

  /// Moves the bodies by one tick. Headings are advanced as well; bodies that moved or overlap are awake afterwards, all
  /// others asleep.
  void move(Bodies&, const Drives&);

  [[nodiscard]] const ContactLimits& limits() const { return limits_; }

 private:
  /// Two doubles, worked on by one instruction.
  using Two = double __attribute__((vector_size(16)));

  struct ContactPair {          ///< two contacts of a body; the last of an odd number is filled up by one that never acts
    Two normal_x, normal_y;     ///< from the body to the other
    Two gap_mm;                 ///< at the tick's start
    std::uint32_t other[2];     ///< index of the body; after link(), its slot
  };
  struct Slot {                 ///< a body that may move and has neighbours; slot 0 stands for all that cannot move
    std::uint32_t body = 0;
    std::uint32_t first_pair = 0;
    double cos_turn = 1, sin_turn = 0;  ///< of a sub-step
    bool near_wall = false;
  };
  struct Motion {               ///< of a slot within the tick; x, y
    Two shift_mm = {0, 0};      ///< displacement since the tick's start
    Two drive_mm = {0, 0};      ///< by the drive alone in the coming sub-step
  };

  /// False: everything rests.
  bool find_contacts(Bodies&, const Drives&);
  void search(const Bodies&, std::uint32_t body);
  void link(const Drives&);
  template <bool kWithOverlaps>
  void sub_step(const Bodies&);
  template <bool kWithOverlaps, std::size_t kPairs>
  void move_slot(const Bodies&, std::uint32_t slot);
  /// Moves what has no neighbour, for the whole tick at once.
  void move_free(Bodies&, const Drives&) const;
  void place(Bodies&, std::uint32_t body, double to_x_mm, double to_y_mm) const;

  ContactLimits limits_;
  double axle_offset_mm_;
  CellList cells_;
  std::vector<Slot> slots_;
  std::vector<ContactPair> pairs_;
  std::size_t pair_count_ = 0;
  /// Slots with 0, 1, 2, 3 and more pairs of contacts, and where the first four groups end.
  static constexpr std::size_t kMorePairs = 4;
  std::vector<std::uint32_t> by_pairs_;
  std::array<std::size_t, kMorePairs + 1> pairs_end_{};
  std::vector<std::uint32_t> slot_of_;     ///< per body; 0: none
  std::vector<std::uint32_t> drive_of_;    ///< per body; index of its drive + 1; 0: none
  std::vector<std::uint32_t> pulled_;      ///< sleeping bodies beside one that is driven or overlaps
  std::vector<std::uint8_t> is_pulled_, overlaps_;  ///< per body
  std::vector<std::uint32_t> found_;
  bool any_overlap_ = false;
  std::vector<Two> half_gap_mm_;           ///< of the contacts of the body at hand
  std::vector<Motion> now_, after_;        ///< per slot
};

}  // namespace kilotwin::physics
