#include "core/experiment/field_checks.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>

#include "core/base/say.hpp"
#include "core/base/time.hpp"
#include "core/experiment/fields.hpp"
#include "core/experiment/kilogrid.hpp"
#include "core/experiment/limits.hpp"
#include "core/experiment/surroundings.hpp"
#include "core/plan/world.hpp"

namespace kilotwin {
namespace pb = google::protobuf;

namespace {

using pb::FieldDescriptor;

/// Applies the table of ranges to every field that is present, depth first.
class RangeCheck {
 public:
  explicit RangeCheck(const SourceLocations& locations) : locations_(locations) {}
  void check(const pb::Message& message);

 private:
  struct Frame {
    const FieldDescriptor* field;
    int index;
  };
  void check_element(const pb::Message& message, const FieldDescriptor& field, int index);
  void check_number(const FieldDescriptor& field, double value, const std::string& shown) const;
  [[nodiscard]] std::string path() const {
    std::string text;
    for (const auto& [field, index] : frames_) {
      text += (text.empty() ? "" : ".") + field->name();
      if (field->is_repeated()) text += fmt::format("[{}]", index);
    }
    return text;
  }

  const SourceLocations& locations_;
  std::vector<Frame> frames_;
};

void RangeCheck::check(const pb::Message& message) {
  std::vector<const FieldDescriptor*> present;
  message.GetReflection()->ListFields(message, &present);
  for (const FieldDescriptor* field : present) {
    const int size = field->is_repeated() ? message.GetReflection()->FieldSize(message, field) : 1;
    frames_.push_back(Frame{field, 0});
    for (int i = 0; i < size; ++i) {
      frames_.back().index = i;
      check_element(message, *field, i);
    }
    frames_.pop_back();
  }
}

void RangeCheck::check_element(const pb::Message& message, const FieldDescriptor& field, int i) {
  const pb::Reflection& r = *message.GetReflection();
  const bool list = field.is_repeated();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return check(list ? r.GetRepeatedMessage(message, &field, i) : r.GetMessage(message, &field));
    case FieldDescriptor::CPPTYPE_DOUBLE: {
      const double value = list ? r.GetRepeatedDouble(message, &field, i) : r.GetDouble(message, &field);
      return check_number(field, value, number_text(value));
    }
    case FieldDescriptor::CPPTYPE_UINT32: {
      const std::uint32_t value = list ? r.GetRepeatedUInt32(message, &field, i) : r.GetUInt32(message, &field);
      return check_number(field, value, std::to_string(value));
    }
    case FieldDescriptor::CPPTYPE_STRING: {
      const std::string value = list ? r.GetRepeatedString(message, &field, i) : r.GetString(message, &field);
      for (const char c : value) {
        if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) continue;
        throw locations_.error(path(), field.name() + " holds a control character; it takes plain text");
      }
      if (value.empty()) throw locations_.error(path(), field.name() + " is empty; state it or leave it out");
      return;
    }
    default: return;
  }
}

void RangeCheck::check_number(const FieldDescriptor& field, double value, const std::string& shown) const {
  const FieldRule* const rule = rule_of(field);
  const bool finite = value - value == 0;
  if (finite && (rule == nullptr || rule->allows(value))) return;
  throw locations_.error(path(), fmt::format("{} is {}; it takes {}", field.name(), shown, value_text(field)));
}

void check_name(const LoadedExperiment& loaded) {
  constexpr std::size_t kLongestName = 100;
  const std::string& name = loaded.experiment.name();
  const std::size_t odd =
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_");
  if (odd == std::string::npos && !name.empty() && name.size() <= kLongestName) return;
  throw loaded.locations.error("name", fmt::format("name is \"{}\"; it takes 1 to {} letters, digits, '-' and '_'",
                                                   one_line(name, 60), kLongestName));
}

void check_heading(const LoadedExperiment& loaded, const std::string& path, bool has_angle,
                   proto::Heading heading) {
  if (!has_angle || heading == proto::HEADING_FIXED) return;
  throw loaded.locations.error(path + ".heading_deg",
                               "heading_deg has no effect here; add heading: HEADING_FIXED, or remove it");
}

void check_layout(const LoadedExperiment& loaded, const proto::RobotGroup& group, const std::string& path) {
  const proto::Layout& layout = group.layout();
  const auto with_heading = [&](const auto& shape, const char* name) {
    check_heading(loaded, path + ".layout." + name, shape.has_heading_deg(), shape.heading());
  };
  switch (layout.shape_case()) {
    case proto::Layout::kGrid: return with_heading(layout.grid(), "grid");
    case proto::Layout::kRandom: return with_heading(layout.random(), "random");
    case proto::Layout::kRings: {
      with_heading(layout.rings(), "rings");
      const int counts = layout.rings().count_size(), radii = layout.rings().radius_mm_size();
      if (counts == radii && counts > 0) return;
      throw loaded.locations.error(
          path + ".layout.rings",
          fmt::format("rings has {} count and {} radius_mm; give as many of one as of the other, "
                      "at least one each",
                      counts, radii));
    }
    case proto::Layout::kPoses:
      if (layout.poses().has_csv()) return;
      throw loaded.locations.error(path + ".layout.poses", "csv is missing; state csv: \"FILE.csv\"");
    case proto::Layout::SHAPE_NOT_SET: return;
  }
}

std::uint64_t sum_of(const pb::RepeatedField<std::uint32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

void check_count(const LoadedExperiment& loaded, const proto::RobotGroup& group, const std::string& path) {
  const auto shape = group.layout().shape_case();
  if (shape == proto::Layout::kPoses) return;
  if (shape == proto::Layout::kRings) {
    const auto& counts = group.layout().rings().count();
    const std::uint64_t right = sum_of(counts);
    if (!group.has_count() || group.count() == right) return;
    throw loaded.locations.error(path + ".count",
                                 fmt::format("count is {} but the rings hold {} robots; write {} or leave "
                                             "count out",
                                             group.count(), right, right));
  }
  if (!group.has_count())
    throw loaded.locations.error(path, "count is missing; state count: N, the number of robots");
}

void check_behaviour(const LoadedExperiment& loaded, const proto::RobotGroup& group, const std::string& path) {
  if (group.body() == proto::RobotGroup::TRACKED) {
    if (!group.says().shadow()) {
      if (group.behaviour_size() == 0) return;
      throw loaded.locations.error(
          path + ".behaviour",
          "a tracked group runs no program here; remove behaviour, or add says { shadow: true }");
    }
  }
  if (group.behaviour_size() == 0) {
    throw loaded.locations.error(path, "behaviour is missing; state behaviour: \"FILE.c\", the robots' program");
  }
  for (int i = 0; i < group.behaviour_size(); ++i) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(loaded.resolve(group.behaviour(i)), ignored)) continue;
    throw loaded.locations.error(fmt::format("{}.behaviour[{}]", path, i),
                                 fmt::format("there is no file {}; name a program, relative to the experiment file",
                                             one_line(loaded.resolve(group.behaviour(i)).string())));
  }
}

void check_partition(const LoadedExperiment& loaded, const char* field, std::uint32_t count, const char* side,
                     double side_mm) {
  const double cell_mm = side_mm / count, diameter_mm = 2 * kRobotRadius_mm;
  if (cell_mm >= diameter_mm) return;
  throw loaded.locations.error(
      std::string{"deployment."} + field,
      fmt::format("{} is {}, which cuts the arena's {} of {} mm into cells of {:.3g} mm, smaller than "
                  "a robot; it takes at most {}",
                  field, count, side, number_text(side_mm), cell_mm, static_cast<int>(side_mm / diameter_mm)));
}

void check_tick_multiples(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  const double tick_s = TickLength{experiment.tick_cycles()}.seconds();
  if (experiment.recording().every_s() < tick_s) {
    throw loaded.locations.error("recording.every_s",
                                 fmt::format("every_s is {}, shorter than a tick; it takes at least {} s",
                                             number_text(experiment.recording().every_s()), number_text(tick_s)));
  }
  for (int i = 0; i < experiment.recording().variable_size(); ++i) {
    const proto::RecordedVariable& variable = experiment.recording().variable(i);
    const std::string path = fmt::format("recording.variable[{}]", i);
    if (i >= kMostVariables)
      throw loaded.locations.error(path, fmt::format("there are {} variables; it takes at most {}",
                                                     experiment.recording().variable_size(), kMostVariables));
    if (variable.name().empty())
      throw loaded.locations.error(path, "a variable without a name; give name: \"hops\"");
    if (variable.every_s() < tick_s) {
      throw loaded.locations.error(path + ".every_s",
                                   fmt::format("every_s is {}, shorter than a tick; it takes at least {} s",
                                               number_text(variable.every_s()), number_text(tick_s)));
    }
  }
  const double checkpoint_s = experiment.deployment().checkpoint_every_s();
  if (checkpoint_s > 0 && checkpoint_s < tick_s) {
    throw loaded.locations.error(
        "deployment.checkpoint_every_s",
        fmt::format("checkpoint_every_s is {}, shorter than a tick; it takes 0 for none, or at least "
                    "{} s",
                    number_text(checkpoint_s), number_text(tick_s)));
  }
}

void check_robot_models(const LoadedExperiment& loaded) {
  std::vector<int> entry_of(kMostRobots, -1);
  for (int i = 0; i < loaded.experiment.robot_model_size(); ++i) {
    const proto::RobotModel& model = loaded.experiment.robot_model(i);
    const std::string path = fmt::format("robot_model[{}]", i);
    if (!model.has_robot()) {
      throw loaded.locations.error(path, "robot is missing; state robot: ID, the robot that the entry is about");
    }
    int& entry = entry_of[model.robot()];
    if (entry >= 0) {
      throw loaded.locations.error(
          path, fmt::format("robot {} has an entry already, at {}; keep one of them", model.robot(),
                            loaded.locations.where(fmt::format("robot_model[{}]", entry))));
    }
    entry = i;
  }
}

/// Checks the tilt of the floor and the axle offset, whose limits depend on the physics engine.
void check_floor_and_axle(const LoadedExperiment& loaded) {
  const proto::Physics& physics = loaded.experiment.physics();
  const auto level_floor = [&](const char* field, bool given, double value) {
    if (!given || value == 0 || physics.engine() == proto::Physics::ODE) return;
    throw loaded.locations.error(
        std::string{"physics."} + field,
        fmt::format("{} is {}, but the floor of the {} engine is level; add engine: ODE, or remove it", field,
                    number_text(value), proto::Physics::Engine_Name(physics.engine())));
  };
  level_floor("tilt_deg", physics.has_tilt_deg(), physics.tilt_deg());
  level_floor("downhill_deg", physics.has_downhill_deg(), physics.downhill_deg());
  constexpr double kLeastAxleOffset_mm = 1;
  const double offset_mm = loaded.experiment.motion().axle_offset_mm();
  if (physics.engine() != proto::Physics::ODE || offset_mm >= kLeastAxleOffset_mm) return;
  throw loaded.locations.error(
      "motion.axle_offset_mm",
      fmt::format("axle_offset_mm is {}, with which a robot of the ODE engine falls over its rear legs; it takes "
                  "{}..{} mm there",
                  number_text(offset_mm), number_text(kLeastAxleOffset_mm), number_text(kRobotRadius_mm)));
}

void check_arena(const LoadedExperiment& loaded) {
  const proto::Arena& arena = loaded.experiment.arena();
  if (arena.shape_case() == proto::Arena::SHAPE_NOT_SET) return;
  const std::string shape = arena.has_circle() ? "circle" : "polygon";
  for (const char* const field : {"width_mm", "height_mm"}) {
    const bool given = field[0] == 'w' ? arena.has_width_mm() : arena.has_height_mm();
    if (given) {
      throw loaded.locations.error(std::string{"arena."} + field,
                                   fmt::format("{} has no effect beside {}; remove one of them", field, shape));
    }
  }
  try {
    static_cast<void>(ArenaShape(arena));
  } catch (const std::invalid_argument& error) {
    throw loaded.locations.error(
        "arena." + shape, fmt::format("{} is wrong: {}; {}", shape, error.what(),
                                      arena.has_circle() ? "state radius_mm"
                                                         : "it takes the 3 to 32 corners of a convex polygon in "
                                                           "order, around the origin"));
  }
}

template <class Bodies>
void check_shapes(const LoadedExperiment& loaded, const Bodies& bodies, const char* list, int most) {
  if (bodies.size() > most) {
    throw loaded.locations.error(
        list, fmt::format("there are {} of {}; an experiment takes at most {}", bodies.size(), list, most));
  }
  for (int i = 0; i < bodies.size(); ++i) {
    const auto& body = bodies.Get(i);
    const std::string path = fmt::format("{}[{}]", list, i);
    if (body.shape_case() == 0) {
      throw loaded.locations.error(
          path, fmt::format("{} has no shape; it takes box, cylinder or polygon {{ ... }}", list));
    }
    try {
      Point2 centre;
      static_cast<void>(shape_of(body, centre));
    } catch (const std::invalid_argument& error) {
      const char* const shape = body.has_box() ? "box" : body.has_cylinder() ? "cylinder" : "polygon";
      const char* const right = body.has_box()        ? "state width_mm and length_mm"
                                : body.has_cylinder() ? "state radius_mm"
                                                      : "it takes the 3 to 32 corners of a convex polygon in order";
      throw loaded.locations.error(path + "." + shape,
                                   fmt::format("{} is wrong: {}; {}", shape, error.what(), right));
    }
  }
}

void check_bodies(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  check_shapes(loaded, experiment.obstacle(), "obstacle", kMostObstacles);
  check_shapes(loaded, experiment.movable(), "movable", kMostMovables);
  for (int i = 0; i < experiment.movable_size(); ++i) {
    if (experiment.movable(i).has_mass_g()) continue;
    throw loaded.locations.error(fmt::format("movable[{}]", i),
                                 "mass_g is missing; state mass_g: M, the body's mass");
  }
}

/// Refuses features that the physics engine does not compute.
void check_engine(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  if (experiment.physics().engine() == proto::Physics::ODE) return;
  const auto refuse = [&](const std::string& path, std::string_view what) {
    throw loaded.locations.error(
        path, fmt::format("the {} engine knows no {}; remove it or choose another physics.engine",
                          proto::Physics::Engine_Name(experiment.physics().engine()), what));
  };
  if (experiment.physics().engine() == proto::Physics::PLANAR) return;
  if (experiment.arena().has_circle()) refuse("arena.circle", "round walls");
  if (experiment.arena().has_polygon()) refuse("arena.polygon", "walls along a polygon");
  if (experiment.obstacle_size() > 0) refuse("obstacle[0]", "obstacles");
  if (experiment.movable_size() > 0) refuse("movable[0]", "movable bodies");
  for (int g = 0; g < experiment.robots_size(); ++g) {
    if (experiment.robots(g).immobile()) refuse(fmt::format("robots[{}].immobile", g), "immobile robots");
  }
}

}  // namespace

std::uint64_t stated_count(const proto::RobotGroup& group) {
  if (group.has_count()) return group.count();
  return sum_of(group.layout().rings().count());
}

void check_total(const LoadedExperiment& loaded, std::uint64_t robots) {
  if (robots > kMostRobots) {
    throw loaded.locations.error(
        "robots",
        fmt::format("the groups have {} robots together; an experiment takes 1..{}", robots, kMostRobots));
  }
  if (loaded.experiment.station().environment_size() > 0 && robots > kMostArkRobots) {
    throw loaded.locations.error(
        "station.environment",
        fmt::format("environment is given with {} robots, but ARK's messages address 10-bit ids; it "
                    "takes at most {} robots",
                    robots, kMostArkRobots));
  }
  const auto& groups = loaded.experiment.robots();
  const auto hears = std::find_if(groups.begin(), groups.end(),
                                  [](const proto::RobotGroup& group) { return group.has_hears_simulated(); });
  if (hears != groups.end() && robots > kMostArkRobots) {
    throw loaded.locations.error(
        fmt::format("robots[{}].hears_simulated", hears - groups.begin()),
        fmt::format("hears_simulated is given with {} robots, but ARK's messages address 10-bit ids; it takes at "
                    "most {} robots",
                    robots, kMostArkRobots));
  }
  if (loaded.experiment.deployment().hosts() > robots) {
    throw loaded.locations.error("deployment.hosts",
                                 fmt::format("hosts is {}, more than there are robots; it takes 1..{}",
                                             loaded.experiment.deployment().hosts(), robots));
  }
}

void check_values(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  RangeCheck{loaded.locations}.check(experiment);
  check_name(loaded);
  check_tick_multiples(loaded);
  check_arena(loaded);
  check_bodies(loaded);
  check_engine(loaded);
  check_floor_and_axle(loaded);
  const ArenaShape arena(experiment.arena());
  check_partition(loaded, "partition_columns", experiment.deployment().partition_columns(), "width",
                  2 * arena.half_width_mm());
  check_partition(loaded, "partition_rows", experiment.deployment().partition_rows(), "height",
                  2 * arena.half_height_mm());
  check_robot_models(loaded);
  check_station(loaded);
  check_surroundings(loaded);
  check_effects(loaded);
  check_radio(loaded);
  check_doors(loaded);
  check_tracking(loaded);
  if (experiment.robots_size() == 0 || experiment.robots_size() > kMostGroups) {
    throw loaded.locations.error("robots",
                                 fmt::format("there are {} groups of robots; it takes 1..{}, robots {{ ... }}",
                                             experiment.robots_size(), kMostGroups));
  }
}

void check_fields(const LoadedExperiment& loaded) {
  check_values(loaded);
  const proto::Experiment& experiment = loaded.experiment;
  std::uint64_t total = 0;
  bool known = true;
  for (int g = 0; g < experiment.robots_size(); ++g) {
    const proto::RobotGroup& group = experiment.robots(g);
    const std::string path = fmt::format("robots[{}]", g);
    check_layout(loaded, group, path);
    check_count(loaded, group, path);
    check_behaviour(loaded, group, path);
    total += stated_count(group);
    known = known && stated_count(group) > 0;
  }
  check_cells(loaded);
  check_station_files(loaded);
  if (known) check_total(loaded, total);
}

}  // namespace kilotwin
