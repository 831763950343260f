/// Data of the contact passes: columns of eight, with the same memory layout for every instruction set. contact.hpp states
/// the method.
///
/// A batch holds bodies with similar numbers of contacts, one body per lane, so that few lanes idle. A body's slot is its
/// index among the lanes of all batches; it is also the row of its motion. Batch 0 stands for all bodies that do not move.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kilotwin::physics {

inline constexpr std::size_t kLanes = 8;
using Slot = std::uint32_t;

/// One contact of each body of a batch.
struct alignas(64) ContactLanes {
  double normal_x[kLanes], normal_y[kLanes];  ///< from the body to the other
  double gap_mm[kLanes];             ///< at the tick's start; kNoContact_mm where a lane has no such contact
  double normal_impulse_mm[kLanes];  ///< contact_state.hpp states the unit
  double tangent_impulse_mm[kLanes];
  double spin_mm[kLanes];  ///< distance that both rims travel about their centres in a sub-step, added
  Slot other[kLanes];
  std::uint32_t there[kLanes];  ///< index of the other body; of any disc where a lane has no such contact
};

/// Constants of one contact of each body, for batches that also have contacts with other shapes than discs: gain of the
/// normal impulse per closing speed, and largest ratio of tangent to normal impulse.
struct alignas(64) SpecialLanes {
  double gain[kLanes], friction[kLanes];
};

struct alignas(64) ContactBatch {
  double x_mm[kLanes] = {}, y_mm[kLanes] = {};              ///< at the tick's start
  double drive_x_mm[kLanes] = {}, drive_y_mm[kLanes] = {};  ///< velocity of the drive alone in the coming sub-step
  double slip_x_mm[kLanes] = {}, slip_y_mm[kLanes] = {};    ///< velocity minus that of the drive
  double shift_x_mm[kLanes] = {}, shift_y_mm[kLanes] = {};  ///< displacement since the tick's start
  double extrapolated_x_mm[kLanes] = {},
         extrapolated_y_mm[kLanes] = {};                ///< extrapolated velocity: 2 v - v of the last sub-step
  double grip_mm[kLanes] = {};                          ///< largest impulse of the ground in a sub-step
  double cos_turn[kLanes] = {}, sin_turn[kLanes] = {};  ///< of a sub-step; read only for driven bodies
  double discs[kLanes] = {};                            ///< number of contacts with discs; they come first
  std::uint32_t body[kLanes] = {};                      ///< index of the body
  std::uint32_t first_contact = 0, contacts = 0;
  std::uint32_t used = 0;  ///< contacts from this index on are beyond the cutoff in all lanes
  std::uint32_t first_special = 0;
  std::uint32_t passes = 0;  ///< number of sub-steps in which the batch moves, from the first
  std::uint32_t size = 0;    ///< lanes in use; the others repeat the first body without contacts
  bool near_wall = false;    ///< any body is near a wall
  bool special = false;      ///< any contact is with another shape than a disc
  bool slips[kLanes] = {};   ///< the body slips at the tick's start
  bool overlap = false;      ///< any body overlaps another at the tick's start
};

/// Columns over bodies: poses and drives.
struct BodyColumns {
  const double *x_mm, *y_mm;
  const double *drive_x_mm, *drive_y_mm;  ///< in the first sub-step
  const double *cos_turn, *sin_turn;      ///< of a sub-step
  const double* turn_rad;                 ///< of the tick
  const std::uint8_t* driven;             ///< 1: driven, 0: at rest
};

/// Constants of a run.
struct PassLimits {
  double grip_mm[2];  ///< largest ground impulse per sub-step: of a resting and of a driven robot
  double separation_mm, stride_mm, touch_mm, x_limit_mm, y_limit_mm, friction;
  double cutoff_square_mm2;    ///< farther centres at the tick's start: no contact within the tick
  double rim_mm_per_turn_rad;  ///< travel of a rim in a sub-step per turn in the tick
  std::uint32_t sub_steps;
};

/// How a batch starts a tick.
struct Start {
  double nearest_mm;  ///< least distance of centres within the cutoff, or more; at 0, normals are not finite
  bool is_new;        ///< a contact has entered the cutoff since the last tick, so contacts must be reordered
};

/// The inner loops, compiled for one instruction set; all of them give the same bits.
struct ContactKernel {
  const char* name;
  /// Fills in a batch's positions and drives, and the normals and gaps of its contacts with discs. Writes its slots' rows:
  /// displacement 0, and velocity. Sets impulses of contacts beyond the cutoff to 0. If slots are `kept` from tick to tick,
  /// sets the slip of bodies without a contact within the cutoff to 0.
  Start (*begin)(const PassLimits&, bool kept, const BodyColumns&, ContactBatch&, ContactLanes* contacts,
                 double* rows);
  /// A Jacobi pass over batches [0, count): reads the rows `now` of all slots and writes the rows `after`. A row is the
  /// displacement and the extrapolated velocity of a slot: x, y, x, y. `overlap`: some bodies overlap. `room_mm`: scratch,
  /// kLanes per contact.
  void (*pass)(const PassLimits&, std::uint32_t step, bool overlap, ContactBatch* batches, std::size_t count,
               ContactLanes* contacts, const SpecialLanes* specials, const double* now, double* after,
               double* room_mm);
  /// Moves bodies [0, count), which touch nothing, by one tick. The result has the same bits as that of a batch.
  void (*move_free)(const PassLimits&, const BodyColumns&, double* x_mm, double* y_mm, double* heading_rad,
                    std::size_t count);
  /// Whether any of `count` bodies has moved by more than sqrt(square_mm2) from its position in `from`.
  bool (*any_moved)(const double* x_mm, const double* y_mm, const double* from_x_mm, const double* from_y_mm,
                    std::size_t count, double square_mm2);
};

/// The kernels that this processor can run, the fastest first.
std::size_t contact_kernels(const ContactKernel* (&kernels)[3]);

}  // namespace kilotwin::physics
