/// Options of `run`, `check` and `sweep` that select and change an experiment, and further options of `run`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/output.hpp"
#include "clients/cli/run_monitor.hpp"

namespace CLI {
class App;
}

namespace kilotwin::cli {

struct RunArguments {
  std::filesystem::path experiment;
  std::string mode = "federated";  ///< "local" or "federated"
  std::string partitions;          ///< "CxR"; empty: as in the experiment
  std::optional<std::uint32_t> hosts;
  std::uint32_t threads = 1;  ///< local mode
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::optional<std::uint32_t> robots;
  std::filesystem::path behaviour;  ///< empty: as in the experiment
  std::vector<std::string> set;     ///< FIELD=VALUE
  std::vector<std::string> define;  ///< NAME=VALUE
  std::string kilolib;              ///< behaviours::CompileOptions::kilolib
  std::filesystem::path model;
  std::string pace = "max";
  double max_lateness_ms = 0;  ///< of a tick behind the pace before the run ends; 0: any
  bool realtime = false;       ///< services take precedence over other programs of the machine
  std::optional<double> checkpoint_every_s;
  std::filesystem::path resume;  ///< a run, or one of its checkpoints; empty: from tick 0
  bool record_for_page = false;  ///< also what the page of a run shows
  bool prepare = false;          ///< write the run directory and stop
  std::optional<std::uint32_t> domain;
  double give_up_after_s = 0;  ///< longest wait of services for each other without progress; 0: no limit
  MonitorOptions monitor;
  Output output;
  bool strict = false;  ///< a run in which a program has failed ends with status 1
  bool quiet = false;   ///< print neither progress nor summary
};

/// Adds the argument EXPERIMENT and the options that replace parts of the experiment, for `run`, `check` and `sweep`.
void add_experiment_options(CLI::App& app, RunArguments& arguments);
/// Adds --strict, for `sweep` and `tune`.
void add_strict_option(CLI::App& app, RunArguments& arguments);
/// Adds --seed and --set, for `run` and `debug`.
void add_change_options(CLI::App& app, RunArguments& arguments);

}  // namespace kilotwin::cli
