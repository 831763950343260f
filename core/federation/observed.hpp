/// Observations within a metrics sample.
#pragma once

#include <string>

#include "core/federation/topics.hpp"
#include "idl/recording.pb.h"

namespace kilotwin {

/// Moves what was observed into the sample, which points to `octets` until it is written.
inline void lend_observations(proto::Observations& observed, std::string& octets, WireMetrics& metrics) {
  octets.clear();
  if (observed.variable_size() == 0 && observed.event_size() == 0) return;
  observed.SerializeToString(&octets);
  observed.Clear();
  metrics.observations._length = metrics.observations._maximum = static_cast<std::uint32_t>(octets.size());
  metrics.observations._buffer = reinterpret_cast<std::uint8_t*>(octets.data());  // NOLINT
}

}  // namespace kilotwin
