/// The questions of the station's identification, from its packets on kilotwin/station_packets.
#pragma once

#include <deque>
#include <mutex>
#include <vector>

#include "clients/track/identification.hpp"
#include "core/dds/dds.hpp"
#include "core/federation/topics.hpp"

namespace kilotwin::cli {

class StationQuestions {
 public:
  explicit StationQuestions(const dds::Participant& participant);

  /// Those that left the station until `now_ns` of the steady clock, in order; each once. Times are `now_ns`' clock in s.
  [[nodiscard]] std::vector<track::Question> until(std::int64_t now_ns);

 private:
  void receive(const PublicStationPacket& packet);

  std::mutex mutex_;
  std::deque<track::Question> waiting_;
  dds::Reader<PublicStationPacket> reader_;
};

}  // namespace kilotwin::cli
