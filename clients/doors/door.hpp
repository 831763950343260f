/// A door of an experiment, ready to be used: found by its kind and name, with its robots and its placement.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/doors/placement.hpp"
#include "clients/doors/robot_names.hpp"
#include "core/experiment/load.hpp"

namespace kilotwin::doors {

struct Door {
  proto::Door settings;
  Placement placement;
  RobotNames names;
};

/// Checks the experiment in full and takes its door of the kind. `name` chooses among several; empty: there is one.
/// Throws UserError: the experiment is wrong, it has no such door, or a door that reads poses has no tracked robot to move.
[[nodiscard]] Door open_door(const LoadedExperiment& loaded, proto::Door::KindCase kind, const std::string& name);

}  // namespace kilotwin::doors
