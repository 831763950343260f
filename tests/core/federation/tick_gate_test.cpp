#include "core/federation/tick_gate.hpp"

#include <gtest/gtest.h>

namespace kilotwin {
namespace {

using Ids = std::vector<FederateId>;

TEST(TickGate, IsReadyWhenEveryPublisherHasArrived) {
  TickGate gate({FederateId{7}, FederateId{3}}, Tick{0});
  EXPECT_FALSE(gate.ready(Tick{0}));
  EXPECT_TRUE(gate.accept(FederateId{3}, Tick{0}));
  EXPECT_EQ(gate.missing(Tick{0}), Ids{FederateId{7}});
  EXPECT_TRUE(gate.accept(FederateId{7}, Tick{0}));
  EXPECT_TRUE(gate.ready(Tick{0}));
  EXPECT_FALSE(gate.ready(Tick{1}));
}

TEST(TickGate, LetsPublishersRunAhead) {
  TickGate gate({FederateId{0}, FederateId{1}}, Tick{5});
  for (int t = 5; t < 9; ++t) EXPECT_TRUE(gate.accept(FederateId{0}, Tick{t}));
  EXPECT_EQ(gate.missing(Tick{5}), Ids{FederateId{1}});
  EXPECT_TRUE(gate.accept(FederateId{1}, Tick{5}));
  EXPECT_TRUE(gate.ready(Tick{5}));
  EXPECT_EQ(gate.missing(Tick{6}), Ids{FederateId{1}});
}

TEST(TickGate, RefusesUnknownPublishersAndGapsAndIgnoresRepeats) {
  TickGate gate({FederateId{1}}, Tick{0});
  EXPECT_EQ(gate.arrival(FederateId{2}, Tick{0}), TickGate::Arrival::kUnexpected);
  EXPECT_EQ(gate.arrival(FederateId{1}, Tick{1}), TickGate::Arrival::kUnexpected);
  EXPECT_TRUE(gate.accept(FederateId{1}, Tick{0}));
  EXPECT_EQ(gate.arrival(FederateId{1}, Tick{0}), TickGate::Arrival::kRepeated);
  EXPECT_FALSE(gate.hello(FederateId{9}));
}

TEST(TickGate, RefusesAFrameThatWouldOverwriteAnUnreadOne) {
  TickGate gate({FederateId{1}}, Tick{3});
  for (int t = 3; t < 3 + kFrameRing; ++t) EXPECT_TRUE(gate.accept(FederateId{1}, Tick{t}));
  EXPECT_EQ(gate.arrival(FederateId{1}, Tick{3 + kFrameRing}), TickGate::Arrival::kUnexpected);
  gate.reading(Tick{4});
  EXPECT_TRUE(gate.accept(FederateId{1}, Tick{3 + kFrameRing}));
}

TEST(TickGate, CountsHellosApartFromFrames) {
  TickGate gate({FederateId{1}, FederateId{2}}, Tick{0});
  EXPECT_TRUE(gate.hello(FederateId{2}));
  EXPECT_FALSE(gate.heard_all());
  EXPECT_EQ(gate.unheard(), Ids{FederateId{1}});
  EXPECT_TRUE(gate.hello(FederateId{1}));
  EXPECT_TRUE(gate.heard_all());
  EXPECT_FALSE(gate.ready(Tick{0}));
}

TEST(TickGate, WithoutPublishersIsAlwaysReady) {
  const TickGate gate({}, Tick{0});
  EXPECT_TRUE(gate.heard_all());
  EXPECT_TRUE(gate.ready(Tick{1'000'000}));
}

}  // namespace
}  // namespace kilotwin
