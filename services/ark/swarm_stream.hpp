/// The samples of a run for observers: its description, and the state of the whole swarm as fast as wall time asks for. Nothing of the
/// run waits for an observer: the states are best effort, and the description is one sample that the writer keeps.
#pragma once

#include <chrono>

#include "core/federation/topics.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::ark {

class SwarmStream {
 public:
  /// Writes the description.
  SwarmStream(const RunPlan& plan, const dds::Participant& participant);

  /// The state of a tick, as soon as it is complete. Writes it if somebody reads and the last one lies long enough in the past;
  /// `last`: nothing follows, so it is written in any case.
  void offer(const SwarmView& swarm, bool last);
  /// The run stands still at this state: it is written twice a second while somebody reads. A view without a tick is not.
  void repeat(const SwarmView& swarm);

 private:
  using Clock = std::chrono::steady_clock;
  void write(const SwarmView& swarm);

  const RunPlan& plan_;
  dds::Writer<PublicRunDescription> description_;
  dds::Writer<PublicSwarmState> states_;
  Clock::duration interval_;
  Clock::time_point next_{}, written_{};
};

}  // namespace kilotwin::ark
