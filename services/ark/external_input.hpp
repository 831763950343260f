/// External input, from the public topics: collected on receive threads, handed over on the station's own. Clients can
/// make it keep and write a bounded amount only.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/line_limit.hpp"
#include "core/federation/schedule.hpp"
#include "core/federation/topics.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::ark {

class ExternalInput {
 public:
  ExternalInput(const RunPlan& plan, const dds::Participant& participant);

  /// Directives that have come since the last call, in the order of arrival; sequence numbers and ticks are still to be given.
  std::vector<Directive> take();

 private:
  /// Queues what `make(refusal)` makes of a sample that is new and for this run. A refusal is said, at a bounded rate.
  template <class Sample, class Make> void receive(const std::string& topic, const Sample& sample, Make make);
  void on_run_control(const PublicRunControl&);
  void on_overhead_packet(const PublicOverheadPacket&);
  void on_relocation(const PublicRelocation&);
  [[nodiscard]] bool ours(std::uint64_t run) const { return run == 0 || run == plan_.run(); }
  /// Remembers the client's last request, with the mutex held. Of more than kMostClients, the oldest are forgotten.
  void note(const std::string& client, std::uint32_t request);

  const RunPlan& plan_;
  std::mutex mutex_;
  std::vector<Directive> waiting_;
  std::map<std::string, std::uint32_t> last_request_;  // per topic and client
  std::deque<std::string> clients_;                    // the keys of last_request_, by age
  LineLimit limit_{std::chrono::seconds(1)};
  dds::Reader<PublicRunControl> run_control_;
  dds::Reader<PublicOverheadPacket> overhead_packets_;
  dds::Reader<PublicRelocation> relocations_;
};

}  // namespace kilotwin::ark
