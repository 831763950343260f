/// What every service is given besides its plan and its own index in it.
#pragma once

#include <filesystem>
#include <optional>

#include "core/dds/dds.hpp"
#include "core/federation/checkpoint.hpp"

namespace kilotwin {

struct ServiceContext {
  dds::Transport transport;
  std::filesystem::path run_directory;
  std::optional<Checkpoint> resumed;  ///< where the run starts from a checkpoint

  [[nodiscard]] Tick first() const { return resumed ? resumed->tick : Tick{0}; }
};

}  // namespace kilotwin
