/// VariablesUntil: hands recorded variables to observables that are evaluated at some of the states only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/state_index.hpp"
#include "clients/recorder/swarm_observables.hpp"

namespace kilotwin::recorder {

class VariablesUntil {
 public:
  /// Both must outlive this object.
  VariablesUntil(Reader& reader, const StateIndex& index);

  /// Hands the variables up to a tick that no earlier call has handed over to `to`. Ticks ascend from call to call. Of one variable it
  /// reads at most the newest 256 records: where hosts have written more between two calls, the oldest ones are left out.
  void take(std::int64_t tick, SwarmObservables& to);

 private:
  Reader& reader_;
  const StateIndex& index_;
  std::vector<std::size_t> taken_;  ///< per variable: entries of the index
};

}  // namespace kilotwin::recorder
