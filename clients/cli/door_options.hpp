/// Options that all commands of doors share: which door of which experiment, and the run that it leads to.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "core/dds/dds.hpp"

namespace kilotwin::cli {

struct DoorArguments {
  std::filesystem::path experiment;
  std::string door;    ///< name; empty: the experiment's only one
  dds::Transport run;  ///< how the run is reached
};

/// `kind`: the field of `door` in the experiment file, such as "ros2". `arguments` must outlive the parse.
void add_door_options(CLI::App& app, DoorArguments& arguments, const std::string& kind);

}  // namespace kilotwin::cli
