// Requests of outsiders: what is queued, and what lines they can provoke.
#include "services/ark/external_input.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/scenes.hpp"

namespace kilotwin::ark {
namespace {

class ExternalInputs : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 10'000 && writer_.readers() == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_GT(writer_.readers(), 0u);
  }
  void request(const std::string& client, std::uint32_t number, double x_mm) {
    PublicRelocation sample{};
    std::strncpy(sample.client, client.c_str(), sizeof(sample.client) - 1);
    sample.request = number;
    sample.body = 0;
    sample.x_mm = x_mm;
    writer_.write(sample);
  }
  /// The x of every request up to the one at `last_x_mm`.
  std::vector<double> take_until(double last_x_mm) {
    std::vector<double> places;
    for (int i = 0; i < 10'000 && (places.empty() || places.back() != last_x_mm); ++i) {
      for (const Directive& directive : input_.take()) places.push_back(directive.relocation.pose.x_mm);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return places;
  }

  const RunPlan plan_ = testing::make_plan("", testing::grid_crowd(4, 40, testing::Facing::kRight));
  const dds::DomainClaim claim_ = dds::DomainClaim::any();
  const dds::Participant participant_{{claim_.domain(), {}}};
  ExternalInput input_{plan_, participant_};
  dds::Writer<PublicRelocation> writer_{participant_, topics::relocations()};
};

TEST_F(ExternalInputs, ARequestCountsOnceAndInOrder) {
  request("hand", 1, 10);
  request("hand", 1, 11);  // repeated
  request("other", 1, 12);
  request("hand", 2, 13);
  EXPECT_EQ(take_until(13), (std::vector<double>{10, 12, 13}));
}

/// Each command of a shell is a client of its own.
TEST_F(ExternalInputs, AClientIsHeardHoweverManyCameBefore) {
  for (std::uint32_t i = 0; i < 1100; ++i) {
    request("client " + std::to_string(i), 1, 10);
    if (i % 10 == 9) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the reader keeps 16
      static_cast<void>(input_.take());
    }
  }
  request("the last", 1, 20);
  EXPECT_EQ(take_until(20).back(), 20);
}

/// A client's name may hold anything, and refused requests may come as fast as the network carries them.
TEST_F(ExternalInputs, AStrangerCannotForgeOrFloodTheLog) {
  ::testing::internal::CaptureStderr();
  constexpr std::uint32_t kRequests = 300;
  for (std::uint32_t i = 1; i <= kRequests; ++i) {
    request("x\n[info] the run has ended \033[2J", i, 1e9);
    if (i % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the reader keeps 16
  }
  request("hand", 1, 10);
  EXPECT_EQ(take_until(10), (std::vector<double>{10}));
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(text.find("a request of x?[info] the run has ended ?[2J on the topic relocations is ignored"),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("\n[info]"), std::string::npos) << text;
  const auto lines = std::count(text.begin(), text.end(), '\n');
  EXPECT_LT(lines, kRequests / 10) << text;
}

}  // namespace
}  // namespace kilotwin::ark
