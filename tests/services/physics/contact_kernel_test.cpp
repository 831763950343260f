// The inner loops of contact give the same bits for every instruction set of this processor.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/base/pose.hpp"
#include "services/physics/contact_batch.hpp"

namespace kilotwin::physics {
namespace {

constexpr std::uint32_t kBatches = 6, kMostContacts = 7, kSlots = kBatches * kLanes, kSubSteps = 4;
constexpr PassLimits kLimits{{0.3, 0.04}, 0.16, 0.17, 0.33, 20, 20, 6.25, 40.0 * 40, 16.5 / kSubSteps, kSubSteps};

struct Scene {
  std::vector<ContactBatch> batches;
  std::vector<ContactLanes> contacts;
  std::vector<SpecialLanes> specials;
  std::vector<double> now, after;
  // Per body.
  std::vector<double> x_mm, y_mm, heading_rad, drive_x_mm, drive_y_mm, cos_turn, sin_turn, turn_rad;
  std::vector<std::uint8_t> driven;

  [[nodiscard]] BodyColumns bodies() const {
    return {x_mm.data(),     y_mm.data(),     drive_x_mm.data(), drive_y_mm.data(),
            cos_turn.data(), sin_turn.data(), turn_rad.data(),   driven.data()};
  }
};

Scene make_scene(std::uint32_t seed) {
  std::mt19937 generator(seed);
  const auto value = [&](double size) { return (static_cast<double>(generator() % 20001) - 10000) / 10000 * size; };
  Scene scene;
  scene.batches.resize(kBatches);
  scene.contacts.resize(kBatches * kMostContacts);
  scene.specials.resize(kMostContacts);
  scene.now.resize(4 * kSlots);
  for (double& v : scene.now) v = value(0.3);
  scene.after = scene.now;
  for (std::uint32_t i = 0; i < kSlots; ++i) {
    scene.x_mm.push_back(value(50));
    scene.y_mm.push_back(value(50));
    scene.heading_rad.push_back(value(3.14159));
    for (std::vector<double>* const column : {&scene.drive_x_mm, &scene.drive_y_mm})
      column->push_back(generator() % 5 == 0 ? 0 : value(0.1));
    scene.turn_rad.push_back(value(0.1));
    scene.cos_turn.push_back(std::cos(scene.turn_rad.back() / kSubSteps));
    scene.sin_turn.push_back(std::sin(scene.turn_rad.back() / kSubSteps));
    scene.driven.push_back(generator() % 4 != 0);
  }
  for (SpecialLanes& special : scene.specials) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      special.gain[lane] = 0.1;
      special.friction[lane] = lane % 2 == 0 ? 0.1 : 2;
    }
  }
  for (std::uint32_t b = 0; b < kBatches; ++b) {
    ContactBatch& batch = scene.batches[b];
    batch.first_contact = b * kMostContacts;
    batch.contacts = b == 0 ? 0 : kMostContacts - b;
    batch.passes = b == 0 ? 0 : kSubSteps;
    batch.near_wall = b % 2 == 1;
    batch.special = b % 3 == 1;
    batch.size = kLanes;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      batch.body[lane] = static_cast<std::uint32_t>(b * kLanes + lane);
      batch.discs[lane] = lane == 3 ? batch.contacts / 2 : batch.contacts;
      for (double* const column : {batch.slip_x_mm, batch.slip_y_mm})
        column[lane] = generator() % 5 == 0 ? 0 : value(0.2);
      for (std::uint32_t p = 0; p < kMostContacts; ++p) {
        ContactLanes& contact = scene.contacts[batch.first_contact + p];
        contact.normal_impulse_mm[lane] = generator() % 3 == 0 ? 0 : std::abs(value(0.1));
        contact.tangent_impulse_mm[lane] = value(0.1);
        contact.there[lane] = static_cast<std::uint32_t>(generator() % kSlots);
        contact.other[lane] = contact.there[lane];
      }
    }
  }
  return scene;
}

/// All values that the loops write.
std::vector<double> results(const ContactKernel& kernel, std::uint32_t seed) {
  Scene scene = make_scene(seed);
  std::vector<double> room_mm(kMostContacts * kLanes), all;
  for (std::uint32_t b = 1; b < kBatches; ++b) {
    const ContactBatch& batch = scene.batches[b];
    const Start start =
        kernel.begin(kLimits, seed % 3 == 0, scene.bodies(), scene.batches[b],
                     scene.contacts.data() + batch.first_contact, scene.now.data() + 4 * kLanes * b);
    all.push_back(start.nearest_mm);
    all.push_back(start.is_new);
    for (std::uint32_t p = 0; p < batch.contacts; ++p) {
      ContactLanes& contact = scene.contacts[batch.first_contact + p];
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        // Close enough for contact, on both sides of the touch distance.
        if (contact.gap_mm[lane] < 100) contact.gap_mm[lane] = std::fmod(contact.gap_mm[lane], 0.5);
        if (!std::isfinite(contact.normal_x[lane])) contact.normal_x[lane] = 1, contact.normal_y[lane] = 0;
      }
    }
  }
  for (std::uint32_t step = 0; step < kSubSteps; ++step) {
    kernel.pass(kLimits, step, seed % 2 == 0, scene.batches.data(), scene.batches.size(), scene.contacts.data(),
                scene.specials.data(), scene.now.data(), scene.after.data(), room_mm.data());
    scene.now.swap(scene.after);
  }
  all.insert(all.end(), scene.now.begin(), scene.now.end());
  for (const ContactBatch& batch : scene.batches) {
    all.insert(all.end(), batch.slip_x_mm, batch.slip_x_mm + kLanes);
    all.insert(all.end(), batch.drive_y_mm, batch.drive_y_mm + kLanes);
    for (std::uint32_t p = 0; p < batch.contacts; ++p) {
      const ContactLanes& contact = scene.contacts[batch.first_contact + p];
      for (const double* const column :
           {contact.normal_x, contact.gap_mm, contact.normal_impulse_mm, contact.tangent_impulse_mm})
        all.insert(all.end(), column, column + kLanes);
    }
  }
  const BodyColumns bodies = scene.bodies();
  kernel.move_free(kLimits, bodies, scene.x_mm.data(), scene.y_mm.data(), scene.heading_rad.data(), kSlots - 3);
  for (const auto* column : {&scene.x_mm, &scene.y_mm, &scene.heading_rad})
    all.insert(all.end(), column->begin(), column->end());
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

/// A body without contacts moves with the same bits inside and outside a batch, and headings stay in their range.
TEST(ContactKernel, FreeBodiesMoveAsInABatch) {
  const ContactKernel* kernels[3];
  const std::size_t count = contact_kernels(kernels);
  for (std::size_t k = 0; k < count; ++k) {
    Scene scene = make_scene(5);
    double room_mm[kLanes];
    for (std::uint32_t b = 1; b < kBatches; ++b) {
      ContactBatch& batch = scene.batches[b];
      batch.contacts = 0;
      batch.near_wall = batch.special = false;
      kernels[k]->begin(kLimits, true, scene.bodies(), batch, scene.contacts.data(),
                        scene.now.data() + 4 * kLanes * b);
    }
    for (std::uint32_t step = 0; step < kSubSteps; ++step) {
      kernels[k]->pass(kLimits, step, false, scene.batches.data(), kBatches, scene.contacts.data(),
                       scene.specials.data(), scene.now.data(), scene.after.data(), room_mm);
      scene.now.swap(scene.after);
    }
    const Scene before = scene;
    constexpr std::uint32_t kFree = kSlots - 3;
    kernels[k]->move_free(kLimits, before.bodies(), scene.x_mm.data(), scene.y_mm.data(), scene.heading_rad.data(),
                          kFree);
    for (std::uint32_t i = kLanes; i < kSlots; ++i) {
      const bool is_free = i < kFree;
      EXPECT_EQ(scene.x_mm[i], before.x_mm[i] + (is_free ? scene.now[4 * i] : 0)) << kernels[k]->name << ' ' << i;
      EXPECT_EQ(scene.y_mm[i], before.y_mm[i] + (is_free ? scene.now[4 * i + 1] : 0))
          << kernels[k]->name << ' ' << i;
      EXPECT_EQ(scene.heading_rad[i],
                is_free ? wrapped(before.heading_rad[i] + before.turn_rad[i]) : before.heading_rad[i]);
    }
  }
}

TEST(ContactKernel, DetectsBodiesThatMoved) {
  const ContactKernel* kernels[3];
  const std::size_t count = contact_kernels(kernels);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t who = 0; who < 19; ++who) {
      std::vector<double> x(19, 3), y(19, -4);
      const std::vector<double> from_x = x, from_y = y;
      x[who] += 0.6;
      y[who] -= 0.8;
      const auto moved = [&](double square_mm2) {
        return kernels[k]->any_moved(x.data(), y.data(), from_x.data(), from_y.data(), 19, square_mm2);
      };
      EXPECT_TRUE(moved(0.999));
      EXPECT_FALSE(moved(1.001));
    }
  }
}

}  // namespace
}  // namespace kilotwin::physics
