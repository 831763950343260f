/// What the passes of contact work on: columns of eight, the same in memory for every instruction set. contact.hpp states the law.
///
/// A batch takes bodies with about as many contacts, a body per lane, so that all lanes are at work. A body's seat is its number
/// among all lanes of all batches; where its motion is kept follows from it. The seats of batch 0 stand for all that stay
/// where they are.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kilotwin::physics {

inline constexpr std::size_t kLanes = 8;
using Seat = std::uint32_t;

/// One contact of each body of a batch.
struct alignas(64) ContactLanes {
  double normal_x[kLanes], normal_y[kLanes];  ///< from the body to the other
  double gap_mm[kLanes];                      ///< at the tick's start; huge where a lane has no such contact
  double push_mm[kLanes];                     ///< force of the contact
  double rub_mm[kLanes];                      ///< tangential force
  double spin_mm[kLanes];                     ///< way of both rims about their centres in a sub-step
  Seat other[kLanes];
  // Where the batch has others than discs: by which the force grows with what the two close, and what bounds rub over push.
  double gain[kLanes], friction[kLanes];
};

struct alignas(64) ContactBatch {
  double x_mm[kLanes] = {}, y_mm[kLanes] = {};              ///< at the tick's start
  double drive_x_mm[kLanes] = {}, drive_y_mm[kLanes] = {};  ///< velocity by the drive alone in the coming sub-step
  double slip_x_mm[kLanes] = {}, slip_y_mm[kLanes] = {};    ///< velocity less that of the drive
  double shift_x_mm[kLanes] = {}, shift_y_mm[kLanes] = {};  ///< displacement since the tick's start
  double swing_x_mm[kLanes] = {}, swing_y_mm[kLanes] = {};  ///< velocity, carried on as it changes
  double grip_mm[kLanes] = {};                          ///< the force with which the ground holds it to its drive
  double spin_mm[kLanes] = {};                          ///< way of its rim about its centre in a sub-step
  double cos_turn[kLanes] = {}, sin_turn[kLanes] = {};  ///< of a sub-step; read where the body is driven
  std::uint32_t first_contact = 0, contacts = 0;
  std::uint32_t passes = 0;  ///< it is moved in the first so many sub-steps
  bool near_wall = false;    ///< any of its bodies
  bool special = false;      ///< any of its contacts is with what is no disc
};

/// What is fixed for a run.
struct PassLimits {
  double separation_mm, stride_mm, touch_mm, x_limit_mm, y_limit_mm, friction;
};

/// The inner loops, compiled for one instruction set; all of them give the same bits.
struct ContactKernel {
  const char* name;
  /// Normals and gaps of a batch's contacts with discs, `there`: bodies, kLanes per contact. False where two are in the same
  /// place, whose normal is not finite.
  bool (*face)(const ContactBatch&, const std::uint32_t* there, const double* x_mm, const double* y_mm,
               ContactLanes* contacts);
  /// A Jacobi pass over batches [0, count): motions are read from rows `now` of all seats and written to `after`, each row the
  /// displacement and the swing of a seat, x, y. `overlap`: whether any bodies do. `room_mm` is scratch, kLanes per contact.
  void (*pass)(const PassLimits&, std::uint32_t step, bool overlap, ContactBatch* batches, std::size_t count,
               ContactLanes* contacts, const double* now, double* after, double* room_mm);
};

/// The ones that this processor can run, the fastest first.
std::size_t contact_kernels(const ContactKernel* (&kernels)[3]);

}  // namespace kilotwin::physics
