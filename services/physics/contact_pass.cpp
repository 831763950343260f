#include "services/physics/contact_pass.hpp"

#include <algorithm>

namespace kilotwin::physics {

ContactPass::ContactPass() {
  const ContactKernel* kernels[3];
  contact_kernels(kernels);
  kernel_ = kernels[0];
}

void ContactPass::clear() {
  batches_.clear();
  specials_.clear();
  contact_count_ = 0;
  add_batch(0, 0);
}

void ContactPass::keep_previous() {
  batches_.swap(previous_batches_);
  contacts_.swap(previous_contacts_);
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

void ContactPass::make_special(ContactBatch& batch) {
  batch.special = true;
  batch.first_special = static_cast<std::uint32_t>(specials_.size());
  specials_.resize(specials_.size() + batch.contacts);
}

void ContactPass::rest() {
  now_.assign(batches_.size() * kLanes * kRow, 0);
  after_.assign(now_.size(), 0);
}

void ContactPass::rest(std::size_t number) {
  batches_[number].passes = 0;
  const auto first = static_cast<std::ptrdiff_t>(number * kLanes * kRow);
  std::fill_n(now_.begin() + first, kLanes * kRow, 0);
  std::fill_n(after_.begin() + first, kLanes * kRow, 0);
}

}  // namespace kilotwin::physics
