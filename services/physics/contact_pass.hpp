/// The Jacobi passes of a tick over the bodies in contact. contact.hpp states the law, contact_batch.hpp how they lie.
#pragma once

#include <cstdint>
#include <vector>

#include "services/physics/contact_batch.hpp"

namespace kilotwin::physics {

class ContactPass {
 public:
  static constexpr Seat kStill = 0;

  ContactPass();

  /// Starts a tick with batch 0 alone, in which nothing moves.
  void clear();
  /// Appends a batch; its places and contacts are to be filled in.
  void add_batch(std::uint32_t contacts, std::uint32_t passes);
  [[nodiscard]] ContactLanes* contacts_of(const ContactBatch& batch) {
    return contacts_.data() + batch.first_contact;
  }
  [[nodiscard]] ContactBatch& batch_of(Seat seat) { return batches_[seat / kLanes]; }
  [[nodiscard]] static std::size_t lane_of(Seat seat) { return seat % kLanes; }
  /// Of the batch appended last.
  [[nodiscard]] Seat seat(std::size_t lane) const {
    return static_cast<Seat>((batches_.size() - 1) * kLanes + lane);
  }
  /// Once all batches are there: nobody moves.
  void rest();
  /// Normals and gaps of a batch's contacts; see ContactKernel::face.
  bool face(const ContactBatch& batch, const std::uint32_t* there, const double* x_mm, const double* y_mm) {
    return kernel_->face(batch, there, x_mm, y_mm, contacts_of(batch));
  }
  /// Once drives and slips are filled in: velocities at the tick's start.
  void set_off();

  /// All sub-steps. `with_overlaps`: whether any bodies overlap at the tick's start; none do later where none did then.
  /// `others(step)` moves what is not a disc: it reads now() and writes after().
  template <class Others>
  void run(const PassLimits& limits, std::uint32_t sub_steps, bool with_overlaps, Others&& others) {
    for (std::uint32_t step = 0; step < sub_steps; ++step) {
      kernel_->pass(limits, step, with_overlaps, batches_.data(), batches_.size(), contacts_.data(), now_.data(),
                    after_.data(), room_mm_.data());
      others(step);
      now_.swap(after_);
    }
  }
  /// Of a seat: displacement since the tick's start, x, y; velocity, carried on as it changes, x, y.
  [[nodiscard]] const double* now(Seat seat) const { return now_.data() + kRow * seat; }
  [[nodiscard]] double* after(Seat seat) { return after_.data() + kRow * seat; }
  [[nodiscard]] double* start(Seat seat) { return now_.data() + kRow * seat; }

  /// Displacement over the tick.
  [[nodiscard]] double shift_x_mm(Seat seat) const { return now(seat)[0]; }
  [[nodiscard]] double shift_y_mm(Seat seat) const { return now(seat)[1]; }

 private:
  static constexpr std::size_t kRow = 4;

  const ContactKernel* kernel_;
  std::vector<ContactBatch> batches_;
  std::vector<ContactLanes> contacts_;
  std::size_t contact_count_ = 0;
  std::vector<double> now_, after_;
  std::vector<double> room_mm_;  ///< of the contacts of the batch at hand
};

}  // namespace kilotwin::physics
