/// Counters of the radio from the start of a run.
#pragma once

#include <cstdint>

namespace kilotwin {

/// How often one robot heard another; receiver == sender: how often it sent with success.
struct PairCount {
  std::uint32_t receiver, sender, count;
};

/// Counters of one robot's radio since the start. attempted = sent + backed_off + one that is on the air.
struct RadioCount {
  std::uint32_t attempted = 0;   ///< start pulses
  std::uint32_t sent = 0;        ///< whole packets
  std::uint32_t received = 0;    ///< packets of other robots
  std::uint32_t collided = 0;    ///< receptions lost because something overlapped
  std::uint32_t backed_off = 0;  ///< attempts given up in the leading byte
  bool operator==(const RadioCount&) const = default;
};

}  // namespace kilotwin
