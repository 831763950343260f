#include "core/experiment/load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/base/say.hpp"
#include "idl/model.pb.h"

namespace kilotwin {

namespace {

std::string name_from(const std::filesystem::path& file) {
  std::string name = file.stem().string();
  for (char& c : name) {
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' || c == '_';
    if (!plain) c = '-';
  }
  return name;
}

}  // namespace

LoadedExperiment load_experiment(const std::filesystem::path& file) {
  const std::string name = one_line(file.string());
  LoadedExperiment loaded{{}, file, SourceLocations{name}};
  parse_text(name, read_text(file, name + ":1:1"), loaded.experiment, loaded.locations);
  if (!loaded.experiment.has_name()) loaded.experiment.set_name(name_from(file));
  return loaded;
}

void apply_model(LoadedExperiment& loaded, const std::filesystem::path& file) {
  const std::string name = one_line(file.string());
  proto::Model model;
  SourceLocations locations{name};
  parse_text(name, read_text(file, name + ":1:1"), model, locations);

  LoadedExperiment merged = loaded;
  proto::Experiment& experiment = merged.experiment;
  if (model.has_motion()) {
    experiment.mutable_motion()->MergeFrom(model.motion());
    merged.locations.adopt(locations, "motion", "motion");
  }
  if (model.has_propagation()) {
    proto::Radio& radio = *experiment.mutable_radio();
    proto::Propagation& propagation = *radio.mutable_propagation();
    propagation = model.propagation();
    if (propagation.has_range_mm()) radio.set_range_mm(propagation.range_mm());
    if (propagation.has_oscillator_sd()) radio.set_oscillator_sd(propagation.oscillator_sd());
    propagation.clear_range_mm();
    propagation.clear_oscillator_sd();
    merged.locations.adopt(locations, "propagation", "radio.propagation");
  }
  std::map<std::uint32_t, int> index_of;
  for (int i = experiment.robot_model_size(); i-- > 0;) {
    if (experiment.robot_model(i).has_robot()) index_of[experiment.robot_model(i).robot()] = i;
  }
  std::map<std::uint32_t, int> given;
  for (int i = 0; i < model.robot_size(); ++i) {
    const std::string from = fmt::format("robot[{}]", i);
    if (!model.robot(i).has_robot()) {
      throw locations.error(from, "robot is missing; state robot: ID, the robot that the entry is about");
    }
    const std::uint32_t robot = model.robot(i).robot();
    if (const auto [earlier, first] = given.emplace(robot, i); !first) {
      throw locations.error(from, fmt::format("robot {} has an entry already, at {}; keep one of them", robot,
                                              locations.where(fmt::format("robot[{}]", earlier->second))));
    }
    const auto [known, added] = index_of.emplace(robot, experiment.robot_model_size());
    if (added) experiment.add_robot_model();
    experiment.mutable_robot_model(known->second)->MergeFrom(model.robot(i));
    merged.locations.adopt(locations, from, fmt::format("robot_model[{}]", known->second));
  }
  // Effects refer to fields by name, so both lists are replaced together.
  if (model.effect_size() > 0 || model.field_size() > 0) {
    *experiment.mutable_effect() = model.effect();
    *experiment.mutable_field() = model.field();
    for (const char* const list : {"effect", "field"}) {
      merged.locations.set_option(list, name);
      merged.locations.adopt(locations, list, list);
    }
  }
  loaded = std::move(merged);
}

}  // namespace kilotwin
