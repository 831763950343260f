// The inner loops of contact give the same bits for every instruction set that this processor has.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "services/physics/contact_batch.hpp"

namespace kilotwin::physics {
namespace {

struct Scene {
  std::vector<ContactBatch> batches;
  std::vector<ContactLanes> contacts;
  std::vector<double> now, after, x_mm, y_mm;
  std::vector<std::uint32_t> there;
};

Scene make_scene(std::uint32_t seed) {
  std::mt19937 generator(seed);
  const auto value = [&](double size) { return (static_cast<double>(generator() % 20001) - 10000) / 10000 * size; };
  constexpr std::uint32_t kBatches = 6, kContacts = 7, kSeats = kBatches * kLanes;
  Scene scene;
  scene.batches.resize(kBatches);
  scene.contacts.resize(kBatches * kContacts);
  scene.now.resize(4 * kSeats);
  for (double& v : scene.now) v = value(0.3);
  scene.after = scene.now;
  for (std::uint32_t i = 0; i < kSeats; ++i) {
    scene.x_mm.push_back(value(50));
    scene.y_mm.push_back(value(50));
  }
  for (std::uint32_t b = 0; b < kBatches; ++b) {
    ContactBatch& batch = scene.batches[b];
    batch.first_contact = b * kContacts;
    batch.contacts = b == 0 ? 0 : kContacts - b % 3;
    batch.passes = b == 0 ? 0 : 4;
    batch.near_wall = b % 2 == 1;
    batch.special = b % 3 == 1;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      batch.x_mm[lane] = scene.x_mm[b * kLanes + lane];
      batch.y_mm[lane] = scene.y_mm[b * kLanes + lane];
      for (double* const column : {batch.drive_x_mm, batch.drive_y_mm, batch.slip_x_mm, batch.slip_y_mm})
        column[lane] = generator() % 5 == 0 ? 0 : value(0.2);
      const double* const row = scene.now.data() + 4 * (b * kLanes + lane);
      batch.shift_x_mm[lane] = row[0];
      batch.shift_y_mm[lane] = row[1];
      batch.swing_x_mm[lane] = row[2];
      batch.swing_y_mm[lane] = row[3];
      batch.grip_mm[lane] = 0.04;
      batch.cos_turn[lane] = 0.999;
      batch.sin_turn[lane] = 0.01;
      for (std::uint32_t p = 0; p < kContacts; ++p) {
        ContactLanes& contact = scene.contacts[batch.first_contact + p];
        contact.push_mm[lane] = generator() % 3 == 0 ? 0 : std::abs(value(0.1));
        contact.rub_mm[lane] = value(0.1);
        contact.spin_mm[lane] = value(0.1);
        contact.gain[lane] = 0.1;
        contact.friction[lane] = lane % 2 == 0 ? 0.1 : 2;
        contact.other[lane] = static_cast<Seat>(generator() % kSeats);
      }
    }
  }
  for (std::size_t k = 0; k < kContacts * kLanes; ++k)
    scene.there.push_back(static_cast<std::uint32_t>(generator() % kSeats));
  return scene;
}

/// All that the loops write.
std::vector<double> results(const ContactKernel& kernel, std::uint32_t seed) {
  Scene scene = make_scene(seed);
  std::vector<double> room_mm(7 * kLanes), all;
  for (const ContactBatch& batch : scene.batches) {
    all.push_back(kernel.face(batch, scene.there.data(), scene.x_mm.data(), scene.y_mm.data(),
                              scene.contacts.data() + batch.first_contact));
    for (std::uint32_t p = 0; p < batch.contacts; ++p) {
      ContactLanes& contact = scene.contacts[batch.first_contact + p];
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        contact.gap_mm[lane] =
            std::fmod(contact.gap_mm[lane], 0.5);  // near enough to act, on both sides of a touch
        if (!std::isfinite(contact.normal_x[lane])) contact.normal_x[lane] = 1, contact.normal_y[lane] = 0;
      }
    }
  }
  const PassLimits limits{0.16, 0.17, 0.33, 20, 20, 6.25};
  for (std::uint32_t step = 0; step < 4; ++step) {
    kernel.pass(limits, step, seed % 2 == 0, scene.batches.data(), scene.batches.size(), scene.contacts.data(),
                scene.now.data(), scene.after.data(), room_mm.data());
    scene.now.swap(scene.after);
  }
  all.insert(all.end(), scene.now.begin(), scene.now.end());
  for (const ContactBatch& batch : scene.batches) {
    all.insert(all.end(), batch.slip_x_mm, batch.slip_x_mm + kLanes);
    all.insert(all.end(), batch.drive_y_mm, batch.drive_y_mm + kLanes);
    for (std::uint32_t p = 0; p < batch.contacts; ++p) {
      const ContactLanes& contact = scene.contacts[batch.first_contact + p];
      for (const double* const column : {contact.normal_x, contact.gap_mm, contact.push_mm, contact.rub_mm})
        all.insert(all.end(), column, column + kLanes);
    }
  }
  return all;
}

TEST(ContactKernel, EveryInstructionSetGivesTheSameBits) {
  const ContactKernel* kernels[3];
  const std::size_t count = contact_kernels(kernels);
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const std::vector<double> expected = results(*kernels[count - 1], seed);
    for (std::size_t k = 0; k + 1 < count; ++k) {
      const std::vector<double> measured = results(*kernels[k], seed);
      ASSERT_EQ(measured.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        // A NaN, if any, may have any sign.
        if (std::isnan(expected[i]) && std::isnan(measured[i])) continue;
        ASSERT_EQ(std::memcmp(&measured[i], &expected[i], sizeof(double)), 0)
            << kernels[k]->name << ", scene " << seed << ", value " << i << ": " << measured[i] << " and "
            << expected[i];
      }
    }
  }
}

}  // namespace
}  // namespace kilotwin::physics
