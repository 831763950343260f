/// What `kilotwin run` was asked for; also what `sweep` and `check` share with it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::cli {

struct RunArguments {
  std::filesystem::path experiment;
  std::string mode = "federated";  ///< "local" or "federated"
  std::string partitions;          ///< "CxR"; empty: as the experiment says
  std::optional<std::uint32_t> hosts;
  std::uint32_t threads = 1;  ///< local mode
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::optional<std::uint32_t> robots;
  std::filesystem::path behaviour;  ///< empty: as the experiment says
  std::vector<std::string> set;     ///< FIELD=VALUE
  std::vector<std::string> define;  ///< NAME=VALUE
  std::filesystem::path model;
  std::string pace = "max";
  std::optional<double> checkpoint_every_s;
  std::filesystem::path resume;  ///< a run, or one of its checkpoints; empty: from tick 0
  bool prepare = false;          ///< write the run directory and stop
  std::optional<std::uint32_t> domain;
  std::filesystem::path out;
  bool quiet = false;  ///< no progress, no summary on the screen
};

}  // namespace kilotwin::cli
