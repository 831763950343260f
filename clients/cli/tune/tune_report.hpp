/// Results of `kilotwin tune`: tune.json, points.csv, search.svg, report.html.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/tune/measurement.hpp"
#include "clients/recorder/provenance.hpp"
#include "clients/tune/tuner.hpp"

namespace kilotwin::cli {

struct TuneResult {
  std::string name;  ///< of the experiment
  std::vector<tune::Parameter> parameters;
  Goal goal;
  tune::Tuned tuned;
  tune::Estimate present,
      gain;  ///< the experiment as it stands, and how much better the best point is; empty: not measured
  std::vector<std::string> run_words;  ///< the command line of a run with the best values
  std::size_t seeds = 0;
};

/// Writes the files. Throws RunError; the tables are written first.
void write_tune_report(const TuneResult& result, const std::filesystem::path& directory,
                       const recorder::Provenance& provenance);
/// The lines for the terminal.
[[nodiscard]] std::string in_words(const TuneResult& result);

}  // namespace kilotwin::cli
