// Radio frames changed at random never abort a behaviours host: the checks of core/federation refuse them, or programs go on.
#include <gtest/gtest.h>

#include "core/base/error.hpp"
#include "core/federation/frame_check.hpp"
#include "core/federation/wire.hpp"
#include "core/frames/swarm_view.hpp"
#include "tests/services/behaviours/swarm.hpp"
#include "tests/services/frames/frame_mutation.hpp"

namespace kilotwin::behaviours::test {
namespace {

using kilotwin::test::mutate;
using kilotwin::test::Random;

const char* const kListener =
    "static message_t m; static uint8_t heard;"
    "static message_t* tx(void) { m.data[0] = heard; m.crc = message_crc(&m); return &m; }"
    "static void rx(message_t* got, distance_measurement_t* d) { heard += got->data[0] + estimate_distance(d); }"
    "static void loop(void) { set_color(RGB(heard & 3, 0, 0)); }";

/// A frame that a radio may send: everyone is asked, two messages reach three robots.
Air busy_air() {
  Air air;
  air.ask = {0, 1, 2, 3};
  air.sent = {1, 3};
  air.receptions = {{0, message(1, 7)}, {2, message(2, 8)}, {2, message(1, 9)}};
  return air;
}

TEST(RadioFrameFuzz, NoFrameAbortsAHost) {
  constexpr int kTrials = 1500;
  int refused = 0, accepted = 0, ended = 0;
  std::unique_ptr<Swarm> swarm;
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    if (!swarm) {
      swarm = std::make_unique<Swarm>(std::vector<std::string>{program(kListener)}, 4);
      swarm->start();
    }
    Random random(static_cast<std::uint64_t>(trial));
    const FederateId radio = swarm->plan->radio(), host = swarm->plan->behaviours(HostId{0});
    const RadioFrame right = busy_air().frame(swarm->tick, swarm->plan->share(HostId{0}));
    RadioFrame sent = right, received;
    mutate(random, sent);
    if (!from_wire(to_wire({radio.value(), 1, 0}, sent), received) ||
        defect(received, *swarm->plan, radio, host) != nullptr) {
      ++refused;
      continue;
    }
    ++accepted;
    swarm->bodies.tick = swarm->tick;
    const BodyFrame* const all[] = {&swarm->bodies};
    SwarmView view(swarm->plan->robots(), swarm->plan->movables(), swarm->plan->memory.size());
    view.gather(swarm->tick, all);
    try {
      swarm->hosts[0]->step(swarm->tick, received, &view);
      ++swarm->tick;
      swarm->step(busy_air());
    } catch (const RunError&) {
      ++ended;
      swarm.reset();
    }
  }
  EXPECT_GT(refused, kTrials / 20);
  EXPECT_GT(accepted, kTrials / 20) << "nothing reached the programs";
  RecordProperty("ended", ended);
}

}  // namespace
}  // namespace kilotwin::behaviours::test
