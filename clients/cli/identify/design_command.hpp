/// `kilotwin identify --design`: plans the next recording.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/output.hpp"

namespace kilotwin::cli {

struct DesignArguments {
  std::filesystem::path result;  ///< directory of a result of `identify`
  std::vector<std::filesystem::path> candidates;
  double duration_s = 120, every_s = 0.5;
  std::uint32_t robots = 0;  ///< 0: as many as in the data
  std::string arena;         ///< WIDTHxHEIGHT, mm; empty: the walls of the result
  std::uint64_t seed = 1;
  bool no_headings = false;
  std::uint32_t threads = 2;
  bool quiet = false;
};

/// Plans, and writes the files of the plan. Throws UserError.
int plan_recording(const DesignArguments&, const Output&);

}  // namespace kilotwin::cli
