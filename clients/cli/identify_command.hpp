/// `kilotwin identify`: a model, its evaluation and a report from measured data.
#pragma once

#include <cstdint>
#include <filesystem>

namespace kilotwin::cli {

struct IdentifyArguments {
  std::filesystem::path train, test, out = "identified";
  double horizon_s = 10;
  std::uint32_t threads = 2;
  bool quiet = false;
};

/// Writes model.txtpb, result.json, predictions.csv and report.html into `out`. Returns the exit status.
int identify_command(const IdentifyArguments&);

}  // namespace kilotwin::cli
