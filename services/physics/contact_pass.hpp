/// The Jacobi passes of a tick over the bodies in contact. contact.hpp states the method, contact_batch.hpp the layout.
#pragma once

#include <cstdint>
#include <vector>

#include "services/physics/contact_batch.hpp"

namespace kilotwin::physics {

class ContactPass {
 public:
  static constexpr Slot kStill = 0;

  ContactPass();

  /// Removes all batches but batch 0, in which nothing moves.
  void clear();
  /// Moves all batches to previous_batches_, where they can be read while others are built.
  void keep_previous();
  [[nodiscard]] const ContactBatch& previous_batch_of(Slot slot) const { return previous_batches_[slot / kLanes]; }
  [[nodiscard]] const ContactLanes* previous_contacts_of(const ContactBatch& batch) const {
    return previous_contacts_.data() + batch.first_contact;
  }
  /// Appends a batch; the caller fills in its bodies and contacts.
  void add_batch(std::uint32_t contacts, std::uint32_t passes);
  [[nodiscard]] std::size_t batches() const { return batches_.size(); }
  [[nodiscard]] ContactBatch& batch(std::size_t number) { return batches_[number]; }
  [[nodiscard]] const ContactBatch& batch(std::size_t number) const { return batches_[number]; }
  [[nodiscard]] ContactLanes* contacts_of(const ContactBatch& batch) {
    return contacts_.data() + batch.first_contact;
  }
  [[nodiscard]] const ContactLanes* contacts_of(const ContactBatch& batch) const {
    return contacts_.data() + batch.first_contact;
  }
  /// Marks a batch that has contacts with other shapes than discs, and reserves its SpecialLanes.
  void make_special(ContactBatch&);
  [[nodiscard]] SpecialLanes* specials_of(const ContactBatch& batch) {
    return specials_.data() + batch.first_special;
  }
  [[nodiscard]] static std::size_t lane_of(Slot slot) { return slot % kLanes; }
  [[nodiscard]] const ContactBatch& batch_of(Slot slot) const { return batches_[slot / kLanes]; }
  /// Slot of a lane of the last batch.
  [[nodiscard]] Slot slot(std::size_t lane) const {
    return static_cast<Slot>((batches_.size() - 1) * kLanes + lane);
  }
  /// Sets all batches to rest. Call it after the last add_batch().
  void rest();
  /// Sets the motion of one batch to 0 for this tick.
  void rest(std::size_t number);
  /// See ContactKernel::begin.
  Start begin(const PassLimits& limits, bool kept, const BodyColumns& bodies, std::size_t number) {
    ContactBatch& batch = batches_[number];
    return kernel_->begin(limits, kept, bodies, batch, contacts_of(batch), now_.data() + number * kLanes * kRow);
  }
  [[nodiscard]] const ContactKernel& kernel() const { return *kernel_; }

  /// Runs all sub-steps. `with_overlaps`: whether any bodies overlap at the tick's start; if none do, none do later.
  /// `others(step)` moves all shapes but discs: it reads now() and writes after().
  template <class Others> void run(const PassLimits& limits, bool with_overlaps, Others&& others) {
    for (std::uint32_t step = 0; step < limits.sub_steps; ++step) {
      kernel_->pass(limits, step, with_overlaps, batches_.data(), batches_.size(), contacts_.data(),
                    specials_.data(), now_.data(), after_.data(), room_mm_.data());
      others(step);
      now_.swap(after_);
    }
  }
  /// Row of a slot: displacement since the tick's start, x, y; extrapolated velocity, x, y.
  [[nodiscard]] const double* now(Slot slot) const { return now_.data() + kRow * slot; }
  [[nodiscard]] double* after(Slot slot) { return after_.data() + kRow * slot; }
  [[nodiscard]] double* start(Slot slot) { return now_.data() + kRow * slot; }

 private:
  static constexpr std::size_t kRow = 4;

  const ContactKernel* kernel_;
  std::vector<ContactBatch> batches_;
  std::vector<ContactLanes> contacts_;
  std::vector<ContactBatch> previous_batches_;
  std::vector<ContactLanes> previous_contacts_;
  std::vector<SpecialLanes> specials_;
  std::size_t contact_count_ = 0;
  std::vector<double> now_, after_;
  std::vector<double> room_mm_;  ///< scratch for the contacts of one batch
};

}  // namespace kilotwin::physics
