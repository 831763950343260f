/// Messages that listeners heard of real robots, from the public topic: checked on receive threads, taken on the station's own thread.
/// The queue is bounded: the oldest messages are dropped.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "core/federation/topics.hpp"
#include "core/frames/tracker_sample.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::ark {

class HeardInput {
 public:
  HeardInput(const RunPlan& plan, const dds::Participant& participant);
  /// Messages that have come since the last call, in the order of arrival.
  [[nodiscard]] std::vector<HeardMessage> take();

 private:
  void on_message(const PublicHeardMessage& sample);

  const RunPlan& plan_;
  std::mutex mutex_;  // guards the next one
  std::deque<HeardMessage> waiting_;
  dds::Reader<PublicHeardMessage> reader_;
};

}  // namespace kilotwin::ark
