/// Messages that real robots would hear of simulated ones, as messages of the station: `hears_simulated` in idl/experiment.proto.
///
/// Whenever simulated robots send, each real robot of such a group hears the nearest of them within range. It needs no
/// memory: the queue of the station keeps what waits. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "core/plan/tracking_settings.hpp"
#include "services/ark/ark_message.hpp"

namespace kilotwin::ark {

class SimulatedHearing {
 public:
  explicit SimulatedHearing(const RunPlan& plan);
  [[nodiscard]] bool any() const { return !listeners_.empty(); }
  /// The messages for real robots that are there, by ascending id, from what simulated robots sent at the swarm's tick.
  [[nodiscard]] std::vector<ArkMessage> heard(const SwarmView& swarm) const;

 private:
  struct Listener {
    std::uint32_t robot;
    HearsSettings settings;
  };
  [[nodiscard]] static std::uint16_t payload(const HearsSettings& settings, const SwarmView& swarm,
                                             std::uint32_t listener, std::size_t offer);

  const RunPlan& plan_;
  std::vector<Listener> listeners_;  ///< ascending
};

}  // namespace kilotwin::ark
