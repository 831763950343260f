/// What every service is given besides its plan and its own index in it.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/dds/dds.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/schedule.hpp"

namespace kilotwin {

struct ServiceContext {
  dds::Transport transport;
  std::filesystem::path run_directory;
  std::optional<Checkpoint> resumed;  ///< where the run starts from a checkpoint
  std::vector<Directive> inputs;  ///< that were stamped for ticks to come, before the run went back to a checkpoint
  double give_up_after_s = 0;     ///< how long a service waits for others without progress; 0: for ever

  [[nodiscard]] Tick first() const { return resumed ? resumed->tick : Tick{0}; }
};

}  // namespace kilotwin
