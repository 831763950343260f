/// Arguments of every service besides the plan and its index in it.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/dds/dds.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/schedule.hpp"
#include "core/frames/tracker_sample.hpp"

namespace kilotwin {

struct ServiceContext {
  dds::Transport transport;
  std::filesystem::path run_directory;
  std::optional<Checkpoint> resumed;  ///< the checkpoint from which the run starts, if any
  std::vector<Directive> inputs;      ///< directives of an earlier attempt for ticks after the checkpoint
  /// Samples of trackers that were stamped for ticks to come, as `inputs`; by ascending tick.
  std::vector<std::pair<Tick, TrackerSample>> tracker_samples;
  double give_up_after_s = 0;  ///< longest wait for others without progress; 0: no limit

  [[nodiscard]] Tick first() const { return resumed ? resumed->tick : Tick{0}; }
};

}  // namespace kilotwin
