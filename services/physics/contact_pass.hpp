/// The Jacobi passes of a tick over the bodies in contact, a body per lane. contact.hpp states the law.
///
/// A batch takes bodies with about as many contacts, so that all lanes are at work. A body's seat says where its motion is
/// kept: the batch and the lane. Seat 0 stands for all that stay where they are.
#pragma once

#include <cstdint>
#include <vector>

#include "services/physics/lanes.hpp"

namespace kilotwin::physics {

struct ContactLimits;

class ContactPass {
 public:
  using Seat = std::uint32_t;
  static constexpr Seat kStill = 0;

  /// One contact of each body of a batch.
  struct Contact {
    Lanes normal_x, normal_y;  ///< from the body to the other
    Lanes gap_mm;              ///< at the tick's start; huge where a lane has no such contact
    Lanes push_mm;             ///< force of the contact
    Lanes gain;                ///< by which the force grows with what the two close
    Lanes rub_mm, friction;    ///< tangential force, and its bound over the force of the contact
    Seat other[kLanes];
  };
  struct Batch {
    double x_mm[kLanes] = {}, y_mm[kLanes] = {};  ///< at the tick's start
    double drive_x_mm[kLanes] = {},
           drive_y_mm[kLanes] = {};                         ///< velocity by the drive alone in the coming sub-step
    double slip_x_mm[kLanes] = {}, slip_y_mm[kLanes] = {};  ///< velocity less that of the drive
    double grip_mm[kLanes] = {};                          ///< the force with which the ground holds it to its drive
    double spin_mm[kLanes] = {};                          ///< way of its rim about its centre in a sub-step
    double cos_turn[kLanes] = {}, sin_turn[kLanes] = {};  ///< of a sub-step; read where the body is driven
    std::uint32_t first_contact = 0, contacts = 0;
    std::uint32_t passes = 0;  ///< it is moved in the first so many sub-steps
    bool near_wall = false;    ///< any of its bodies
  };

  /// Starts a tick with batch 0 alone, in which nothing moves.
  void clear();
  /// Appends a batch; its places and contacts are to be filled in.
  void add_batch(std::uint32_t contacts, std::uint32_t passes);
  [[nodiscard]] Contact* contacts_of(const Batch& batch) { return contacts_.data() + batch.first_contact; }
  [[nodiscard]] Batch& batch_of(Seat seat) { return batches_[seat / (kColumns * kLanes)]; }
  [[nodiscard]] static std::size_t lane_of(Seat seat) { return seat % kLanes; }
  /// Of the batch appended last.
  [[nodiscard]] Seat seat(std::size_t lane) const {
    return static_cast<Seat>((batches_.size() - 1) * kColumns * kLanes + lane);
  }
  /// Once all batches are there: nobody moves.
  void rest();
  /// Once drives and slips are filled in: velocities at the tick's start.
  void set_off();

  /// All sub-steps. `with_overlaps`: whether any bodies overlap at the tick's start; none do later where none did then.
  /// `others(step)` moves what is not a disc: it reads now() and writes after().
  template <class Others>
  void run(const ContactLimits& limits, std::uint32_t sub_steps, bool with_overlaps, Others&& others) {
    for (std::uint32_t step = 0; step < sub_steps; ++step) {
      with_overlaps ? sub_step<true>(limits, step) : sub_step<false>(limits, step);
      others(step);
      now_.swap(after_);
    }
  }
  /// Of a seat, kLanes apart: displacement since the tick's start, x, y; velocity, carried on as it changes, x, y;
  /// way of the rim about the centre.
  [[nodiscard]] const double* now(Seat seat) const { return now_.data() + seat; }
  [[nodiscard]] double* after(Seat seat) { return after_.data() + seat; }
  [[nodiscard]] double* start(Seat seat) { return now_.data() + seat; }

  /// Displacement over the tick.
  [[nodiscard]] double shift_x_mm(Seat seat) const { return now_[seat]; }
  [[nodiscard]] double shift_y_mm(Seat seat) const { return now_[seat + kLanes]; }

 private:
  /// As now() says.
  static constexpr std::size_t kColumns = 5;

  template <bool kWithOverlaps> void sub_step(const ContactLimits&, std::uint32_t step);
  template <bool kWithOverlaps> void move(const ContactLimits&, Batch&, const double* now, double* after);

  std::vector<Batch> batches_;
  std::vector<Contact> contacts_;
  std::size_t contact_count_ = 0;
  std::vector<double> now_, after_;
  std::vector<Lanes> limit_mm_;  ///< of the contacts of the batch at hand
};

}  // namespace kilotwin::physics
