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
/// Sums run over neighbours in ascending ids. A body depends on its neighbours only: one hop per sub-step. So of the bodies
/// of other partitions only those are computed that own ones reach by contacts, and one that is h hops away only in the
/// first S - h sub-steps.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/pose.hpp"
#include "core/experiment/plan.hpp"
#include "services/physics/bodies.hpp"
#include "services/physics/candidate_list.hpp"
#include "services/physics/contact_pass.hpp"
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
  double separation_mm;  ///< of an overlapping body per sub-step
  double stride_mm;      ///< no body moves further in a sub-step
  double cutoff_mm;      ///< bodies whose centres are farther apart at the tick's start cannot meet within the tick
  double
      margin_mm;  ///< from a partition's rectangle: all that can matter within a tick, and where bodies can get to
  double x_limit_mm, y_limit_mm;  ///< the centre of a disc stays within +-limit

  [[nodiscard]] bool outside(double x_mm, double y_mm) const;
};

/// A tick is find(), then the drives of those that ask for one, then move().
class ContactSolver {
 public:
  ContactSolver(const RunPlan&, const DriveModel&);

  /// Finds who may touch whom. `own`: per body, whether its next pose is asked for; empty: of all. False: everything rests.
  bool find(const Bodies&, const std::vector<std::uint8_t>& own, const std::vector<Duties>&);
  /// Whether the drive of this driven body can matter.
  [[nodiscard]] bool asks_drive(std::uint32_t body) const { return hops_[body] != kOutOfReach; }
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

  [[nodiscard]] bool may_be_touched(std::uint32_t body) const;
  void search(const Bodies&, std::uint32_t body);
  void seat_movers();
  void fill_contacts(const Bodies&);
  void fill_contacts(const Bodies&, const ContactPass::Batch&, const Mover* movers);
  /// Where bodies are in the same place, which for one and the same body means that the lane has no such contact.
  static void fill_coincident(ContactPass::Contact&, const Lanes& distance_mm, const std::uint32_t* here,
                              const std::uint32_t* there);
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
  // Per body.
  std::vector<std::uint8_t> hops_;  ///< by contacts from the own bodies, or kOutOfReach
  std::vector<std::uint8_t> driven_, active_, overlaps_;
  std::vector<ContactPass::Seat> seat_of_;
  std::vector<std::uint32_t> reached_;  ///< others' bodies, by hops
};

}  // namespace kilotwin::physics
