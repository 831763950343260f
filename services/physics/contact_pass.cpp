#include "services/physics/contact_pass.hpp"

namespace kilotwin::physics {

ContactPass::ContactPass() {
  const ContactKernel* kernels[3];
  contact_kernels(kernels);
  kernel_ = kernels[0];
}

void ContactPass::clear() {
  batches_.clear();
  contact_count_ = 0;
  add_batch(0, 0);
}

void ContactPass::add_batch(std::uint32_t contacts, std::uint32_t passes) {
  ContactBatch& batch = batches_.emplace_back();
  batch.first_contact = static_cast<std::uint32_t>(contact_count_);
  batch.contacts = contacts;
  batch.passes = passes;
  contact_count_ += contacts;
  if (contacts_.size() < contact_count_) contacts_.resize(2 * contact_count_);
  if (room_mm_.size() < contacts * kLanes) room_mm_.resize(contacts * kLanes);
}

void ContactPass::rest() {
  now_.assign(batches_.size() * kLanes * kRow, 0);
  after_.assign(now_.size(), 0);
}

void ContactPass::set_off() {
  for (std::size_t b = 1; b < batches_.size(); ++b) {
    ContactBatch& batch = batches_[b];
    double* row = now_.data() + b * kLanes * kRow;
    for (std::size_t lane = 0; lane < kLanes; ++lane, row += kRow) {
      row[2] = batch.swing_x_mm[lane] = batch.drive_x_mm[lane] + batch.slip_x_mm[lane];
      row[3] = batch.swing_y_mm[lane] = batch.drive_y_mm[lane] + batch.slip_y_mm[lane];
    }
  }
}

}  // namespace kilotwin::physics
