/// What the passes of contact work on: columns of eight, the same in memory for every instruction set. contact.hpp states the law.
///
/// A batch takes bodies with about as many contacts, a body per lane, so that all lanes are at work. A body's slot is its number
/// among all lanes of all batches; where its motion is kept follows from it. The slots of batch 0 stand for all that stay
/// where they are.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kilotwin::physics {

inline constexpr std::size_t kLanes = 8;
using Slot = std::uint32_t;

/// One contact of each body of a batch.
struct alignas(64) ContactLanes {
  double normal_x[kLanes], normal_y[kLanes];  ///< from the body to the other
  double gap_mm[kLanes];                      ///< at the tick's start; huge where a lane has no such contact
  double normal_impulse_mm[kLanes];           ///< normal impulse
  double tangent_impulse_mm[kLanes];          ///< tangent impulse
  double spin_mm[kLanes];                     ///< way of both rims about their centres in a sub-step
  Slot other[kLanes];
  std::uint32_t
      there[kLanes];  ///< the other's number among the bodies; of any disc where a lane has no such contact
};

/// Of a contact of each body of a batch that has others than discs: by which the force grows with what the two close, and what
/// bounds the tangent impulse over the normal one.
struct alignas(64) SpecialLanes {
  double gain[kLanes], friction[kLanes];
};

struct alignas(64) ContactBatch {
  double x_mm[kLanes] = {}, y_mm[kLanes] = {};              ///< at the tick's start
  double drive_x_mm[kLanes] = {}, drive_y_mm[kLanes] = {};  ///< velocity by the drive alone in the coming sub-step
  double slip_x_mm[kLanes] = {}, slip_y_mm[kLanes] = {};    ///< velocity less that of the drive
  double shift_x_mm[kLanes] = {}, shift_y_mm[kLanes] = {};  ///< displacement since the tick's start
  double swing_x_mm[kLanes] = {}, swing_y_mm[kLanes] = {};  ///< velocity, carried on as it changes
  double grip_mm[kLanes] = {};                          ///< the force with which the ground holds it to its drive
  double cos_turn[kLanes] = {}, sin_turn[kLanes] = {};  ///< of a sub-step; read where the body is driven
  double discs[kLanes] = {};        ///< how many of its contacts are with discs; they come first
  std::uint32_t body[kLanes] = {};  ///< its number among the bodies
  std::uint32_t first_contact = 0, contacts = 0;
  std::uint32_t used = 0;  ///< none after so many of its contacts is within the cutoff
  std::uint32_t first_special = 0;
  std::uint32_t passes = 0;  ///< it is moved in the first so many sub-steps
  std::uint32_t size = 0;    ///< lanes that stand for a body; the others repeat the first and have no contacts
  bool near_wall = false;    ///< any of its bodies
  bool special = false;      ///< any of its contacts is with what is no disc
  bool slips[kLanes] = {};   ///< whether a body slips at the tick's start
  bool overlap = false;      ///< any of its bodies overlaps another at the tick's start
};

/// Columns by the bodies' numbers: where they are, and how they are driven.
struct BodyColumns {
  const double *x_mm, *y_mm;
  const double *drive_x_mm, *drive_y_mm;  ///< in the first sub-step
  const double *cos_turn, *sin_turn;      ///< of a sub-step
  const double* turn_rad;                 ///< of the tick
  const std::uint8_t* driven;             ///< 1: driven, 0: at rest
};

/// What is fixed for a run.
struct PassLimits {
  double grip_mm[2];  ///< of a resting and of a driven robot
  double separation_mm, stride_mm, touch_mm, x_limit_mm, y_limit_mm, friction;
  double
      cutoff_square_mm2;  ///< bodies whose centres are farther apart at the tick's start do not touch within the tick
  double rim_mm_per_turn_rad;  ///< way of a rim about its centre in a sub-step, over the turn of the tick
  std::uint32_t sub_steps;
};

/// How a batch starts a tick.
struct Start {
  double
      nearest_mm;  ///< least distance of centres within the cutoff, or more; where it is 0, normals are not finite
  bool
      is_new;  ///< some contact has come within the cutoff since the last tick, so that the order is to be looked at
};

/// The inner loops, compiled for one instruction set; all of them give the same bits.
struct ContactKernel {
  const char* name;
  /// Fills in places, drives, normals and gaps of a batch's contacts with discs, and the rows of its slots at the tick's start:
  /// displacement 0 and velocity. Forces of contacts beyond the cutoff end, and so does the slip of bodies without any contact
  /// within it, if slots are `kept` from tick to tick.
  Start (*begin)(const PassLimits&, bool kept, const BodyColumns&, ContactBatch&, ContactLanes* contacts,
                 double* rows);
  /// A Jacobi pass over batches [0, count): motions are read from rows `now` of all slots and written to `after`, each row the
  /// displacement and the swing of a slot, x, y. `overlap`: whether any bodies do. `room_mm` is scratch, kLanes per contact.
  void (*pass)(const PassLimits&, std::uint32_t step, bool overlap, ContactBatch* batches, std::size_t count,
               ContactLanes* contacts, const SpecialLanes* specials, const double* now, double* after,
               double* room_mm);
  /// The tick of bodies [0, count) that touch nobody and are far from walls: to the last bit where a batch would bring them.
  void (*roll)(const PassLimits&, const BodyColumns&, double* x_mm, double* y_mm, double* heading_rad,
               std::size_t count);
  /// Whether any of `count` bodies has moved by more than the root of this since it was there.
  bool (*any_moved)(const double* x_mm, const double* y_mm, const double* from_x_mm, const double* from_y_mm,
                    std::size_t count, double square_mm2);
};

/// The ones that this processor can run, the fastest first.
std::size_t contact_kernels(const ContactKernel* (&kernels)[3]);

}  // namespace kilotwin::physics
