// .argos files of ARGoS' Kilobot plugin. docs/how-to/from-argos.md lists every element.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "clients/importers/imported.hpp"
#include "clients/importers/xml_source.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::importers {
namespace {

/// Metres as mm, to the micrometre: a difference of 0.1 m is 100 mm, not 99.99999999999999.
double mm(double m) { return std::round(m * 1e6) / 1e3; }
/// Other quantities, to six decimals.
double neat(double value) { return std::round(value * 1e6) / 1e6; }

constexpr double kAxleToCentre_mm =
    9.2;  ///< a robot's position in ARGoS is between its rear legs (the plugin's kilobot_entity)
constexpr double kDefaultLight_m = 1;  ///< distance at which the laws of light are made to agree

/// Why an element has no counterpart. Empty: the element needs no line.
const std::map<std::string, std::string>& reasons_of_elements() {
  static const std::map<std::string, std::string> all{
      {"system@threads", "give --threads with --mode local, or --partitions"},
      {"experiment@ticks_per_second", "a tick is 32.768 ms, the firmware's own"},
      {"profiling", "every run prints its cost per robot and tick"},
      {"visualization", "kilotwin view shows a run in a browser"},
      {"qt-opengl", ""},
      {"loop_functions", "export tables, or write a plugin of the station: docs/how-to/from-ark.md"},
      {"kilobot_led", ""},
      {"kilobot_communication@implementation", ""},
      {"kilobot_communication@medium", ""},
      {"kilobot_communication@show_rays", ""},
      {"kilobot_light@implementation", ""},
      {"kilobot_light@show_rays", ""},
      {"kilobot_light@medium", ""},
      {"differential_steering@implementation", ""},
      {"kilobot_controller@library", ""},
      {"light@orientation", ""},
      {"light@color", ""},
      {"light@medium", ""},
      {"light@id", ""},
      {"led", "robots do not see LEDs"},
      {"dynamics2d@id", ""},
      {"dynamics2d@iterations", "the planar engine has its own steps: physics.sub_steps"},
      {"dynamics3d@id", ""},
      {"dynamics3d@iterations", ""},
      {"pointmass3d@id", ""},
      {"kilobot_communication@id", ""},
      {"box@id", ""},
      {"cylinder@id", ""},
      {"entity@max_trials", ""},
      {"floor@id", ""},
      {"@implementation", ""},
      {"dynamics2d", "physics coefficients of one robot: physics.rim_friction is the product of two"},
  };
  return all;
}

/// The program's source, by the name of what was compiled: "build/behaviors/disperse" is "disperse.c".
std::string source_of(const std::string& behaviour) {
  return std::filesystem::path(behaviour).filename().replace_extension(".c").string();
}

struct Controller {
  std::string behaviour;
  pugi::xml_node node;
};

class ArgosImport {
 public:
  ArgosImport(std::string_view text, const std::string& name) : xml_(text, name), name_(name) {}

  Imported result() {
    const pugi::xml_node root = xml_.root();
    if (std::string_view(root.name()) != "argos-configuration")
      throw UserError(fmt::format("{}: begins with <{}>; an .argos file begins with <argos-configuration>", name_,
                                  root.name()));
    xml_.take(root);
    framework(child(root, "framework"));
    controllers(child(root, "controllers"));
    arena(child(root, "arena"));
    engines(child(root, "physics_engines"));
    media(child(root, "media"));
    if (experiment().robots().empty()) throw UserError(fmt::format("{}: holds no <kilobot>", name_));
    imported_.notes = xml_.notes(reasons_of_elements());
    return std::move(imported_);
  }

 private:
  proto::Experiment& experiment() { return imported_.experiment; }
  pugi::xml_node child(pugi::xml_node parent, const char* name) {
    const pugi::xml_node node = parent.child(name);
    if (node) xml_.take(node);
    return node;
  }

  void framework(pugi::xml_node node) {
    (void)child(node, "system");
    const pugi::xml_node run = child(node, "experiment");
    const double length_s = xml_.number(run, "length").value_or(0);
    if (length_s > 0) {
      experiment().set_duration_s(length_s);
    } else {
      experiment().set_duration_s(600);
      if (run) xml_.note(run, "has no end; 600 s were taken");
    }
    const double seed = xml_.number(run, "random_seed").value_or(0);
    if (seed > 0) experiment().set_seed(static_cast<std::uint64_t>(seed));
  }

  void controllers(pugi::xml_node node) {
    for (const pugi::xml_node controller : node.children()) {
      if (controller.type() != pugi::node_element) continue;
      if (std::string_view(controller.name()) != "kilobot_controller") {
        xml_.take_all(controller);
        xml_.note(controller, "is a controller in C++; write it in C against kilolib, as for the robot");
        controllers_[controller.attribute("id").value()] = {"behaviour.c", controller};
        continue;
      }
      const std::string id = xml_.text(controller, "id");
      const pugi::xml_node parameters = child(controller, "params");
      const std::string behaviour = source_of(xml_.text(parameters, "behavior"));
      controllers_[id] = {behaviour, controller};
      if (parameters)
        xml_.note(parameters, fmt::format("names a compiled program; its source is taken to be {}", behaviour));
      if (const auto speed_cm_s = xml_.number(parameters, "linearvelocity"))
        experiment().mutable_motion()->set_straight_speed_mm_s(10 * *speed_cm_s);
      if (const auto speed_deg_s = xml_.number(parameters, "angularvelocity"))
        experiment().mutable_motion()->set_turn_speed_mm_s(neat(*speed_deg_s * kPi / 180 * 25));
      steering(child(child(controller, "actuators"), "differential_steering"));
      (void)child(controller.child("actuators"), "kilobot_communication");
      sensors(child(controller, "sensors"));
    }
  }

  void steering(pugi::xml_node node) {
    if (!node) return;
    const auto mean = xml_.number(node, "bias_avg"), sd = xml_.number(node, "bias_stddev");
    const auto factor = xml_.number(node, "factor_avg"), factor_sd = xml_.number(node, "factor_stddev");
    proto::Motion& motion = *experiment().mutable_motion();
    if (!mean && !sd && !factor && !factor_sd) {
      motion.set_noise(false);
      return;
    }
    const double share = factor.value_or(1);
    if (mean) motion.set_bias_mean_mm_s(neat(1000 * *mean * share));
    if (sd) motion.set_bias_sd_mm_s(neat(1000 * *sd * share));
    if (share != 1) {
      motion.set_straight_speed_mm_s(10 * share);
      motion.set_turn_speed_mm_s(20 * share);
    }
    if (factor_sd && *factor_sd > 0)
      motion.set_factor_variance_s(neat(*factor_sd * *factor_sd / (share * share) / 31));
  }

  void sensors(pugi::xml_node node) {
    if (!node) return;
    const pugi::xml_node radio = child(node, "kilobot_communication");
    if (const auto noise_mm = xml_.number(radio, "noise_std_dev"); noise_mm && *noise_mm > 0) {
      constexpr double kDb_per_mm = 0.139;  // decay of the signal with distance: Propagation.decay_db_per_mm
      experiment().mutable_radio()->set_model(proto::Radio::PROPAGATION);
      experiment().mutable_radio()->mutable_propagation()->set_reading_sd_db(neat(*noise_mm * kDb_per_mm));
    }
    const pugi::xml_node light = child(node, "kilobot_light");
    if (const auto noise = xml_.number(light, "noise_level"); noise && *noise > 0) {
      proto::LightSensor& sensor = *experiment().mutable_light()->mutable_sensor();
      sensor.set_noise_floor(neat(1024 / std::sqrt(3.0) * *noise));
      sensor.set_noise_relative(0);
      sensor.set_gain_sd(0);
    }
  }

  /// Four thin immovable boxes around the middle are the arena's walls. Returns whether there are such.
  bool walls(pugi::xml_node arena) {
    struct Side {
      pugi::xml_node box;
      double inner_m = 0, length_m = 0;
    };
    std::map<char, Side> sides;
    for (const pugi::xml_node box : arena.children("box")) {
      if (std::string_view(box.attribute("movable").value()) == "true") continue;
      const auto size = xml_.triple(box, "size");
      const auto at = xml_.triple(box.child("body"), "position");
      const bool lies = size[0] > 5 * size[1], stands = size[1] > 5 * size[0];
      const char name = lies ? (at[1] > 0 ? 'n' : 's') : stands ? (at[0] > 0 ? 'e' : 'w') : '\0';
      if (name == '\0' || sides.contains(name)) continue;
      const double across =
          lies ? std::abs(at[1] - origin_[1]) - size[1] / 2 : std::abs(at[0] - origin_[0]) - size[0] / 2;
      sides[name] = {box, across, lies ? size[0] : size[1]};
    }
    if (sides.size() != 4) return false;
    const double width = sides['e'].inner_m + sides['w'].inner_m, height = sides['n'].inner_m + sides['s'].inner_m;
    if (std::min(sides['n'].length_m, sides['s'].length_m) < 0.9 * width ||
        std::min(sides['e'].length_m, sides['w'].length_m) < 0.9 * height)
      return false;
    experiment().mutable_arena()->set_width_mm(mm(width));
    experiment().mutable_arena()->set_height_mm(mm(height));
    for (const auto& [name, side] : sides) {
      xml_.take_all(side.box);
      walls_.push_back(side.box.hash_value());
    }
    return true;
  }

  void arena(pugi::xml_node node) {
    const auto size = xml_.triple(node, "size"), centre = xml_.triple(node, "center");
    origin_ = {centre[0], centre[1]};
    if (centre[0] != 0 || centre[1] != 0)
      xml_.note(node, "is centred at the origin here; all positions were moved");
    experiment().mutable_arena()->set_width_mm(mm(size[0]));
    experiment().mutable_arena()->set_height_mm(mm(size[1]));
    (void)walls(node);
    for (const pugi::xml_node child : node.children()) {
      const std::string_view name = child.name();
      if (name == "box" || name == "cylinder") body(child);
      if (name == "light") light(child);
      if (name == "floor") floor(child);
      if (name == "distribute") distribute(child);
      if (name == "kilobot") robot(child);
    }
    for (const auto& [key, rows] : rows_) {
      PosesFile file{fmt::format("poses-{}.csv", imported_.poses.size() + 1), "x_mm,y_mm,heading_deg\n" + rows};
      group_of(key)->mutable_layout()->mutable_poses()->set_csv(file.name);
      imported_.poses.push_back(std::move(file));
    }
  }

  template <class Body> void place(Body& body, pugi::xml_node node) {
    const pugi::xml_node at = child(node, "body");
    const auto position = xml_.triple(at, "position"), angles = xml_.triple(at, "orientation");
    body.set_x_mm(mm(position[0] - origin_[0]));
    body.set_y_mm(mm(position[1] - origin_[1]));
    if (angles[0] != 0) body.set_heading_deg(angles[0]);
    if (angles[1] != 0 || angles[2] != 0) xml_.note(at, "is tilted; the floor is flat here");
  }
  template <class Body> void shape(Body& body, pugi::xml_node node) {
    if (std::string_view(node.name()) == "box") {
      const auto size = xml_.triple(node, "size");
      body.mutable_box()->set_width_mm(mm(size[0]));
      body.mutable_box()->set_length_mm(mm(size[1]));
      body.mutable_box()->set_height_mm(mm(size[2]));
    } else {
      body.mutable_cylinder()->set_radius_mm(xml_.number(node, "radius").value_or(0.05) * 1000);
      body.mutable_cylinder()->set_height_mm(xml_.number(node, "height").value_or(0.03) * 1000);
    }
  }
  void body(pugi::xml_node node) {
    if (std::find(walls_.begin(), walls_.end(), node.hash_value()) != walls_.end()) return;
    const bool movable = xml_.text(node, "movable") == "true";
    const std::optional<double> mass_kg = xml_.number(node, "mass");
    if (movable) {
      proto::MovableBody& made = *experiment().add_movable();
      shape(made, node);
      place(made, node);
      made.set_mass_g(mass_kg.value_or(1) * 1000);
    } else {
      proto::Obstacle& made = *experiment().add_obstacle();
      shape(made, node);
      place(made, node);
    }
  }

  void light(pugi::xml_node node) {
    const auto at = xml_.triple(node, "position");
    proto::LightSource& source = *experiment().mutable_light()->add_source();
    source.set_x_mm(mm(at[0] - origin_[0]));
    source.set_y_mm(mm(at[1] - origin_[1]));
    if (at[2] > 0) source.set_height_mm(mm(at[2]));
    const double intensity = xml_.number(node, "intensity").value_or(1);
    const double distance_m = at[2] > 0 ? at[2] : kDefaultLight_m;
    source.set_intensity(std::round(1024 * distance_m * distance_m * std::exp(-2 * distance_m / intensity)));
    xml_.note(node, fmt::format("follows the inverse square here; the reading agrees at {:g} m", distance_m));
  }

  void floor(pugi::xml_node node) {
    const std::string source = xml_.text(node, "source"), path = xml_.text(node, "path");
    if (source == "image" && !path.empty()) {
      experiment().mutable_light()->add_image()->add_png(path);
      xml_.note(node, "became projected light, which robots sense; drop it if it is only to look at");
    } else {
      xml_.note(node, "is drawn by loop functions; only a picture has a counterpart, as projected light");
    }
  }

  /// Robots of one program whose poses are stated are one group.
  proto::RobotGroup* group_of(const std::string& behaviour) {
    const auto found = group_index_.find(behaviour);
    if (found != group_index_.end()) return experiment().mutable_robots(found->second);
    group_index_[behaviour] = experiment().robots_size();
    proto::RobotGroup* const group = experiment().add_robots();
    group->add_behaviour(behaviour);
    return group;
  }
  std::string behaviour_of(pugi::xml_node kilobot) {
    const std::string config = xml_.text(child(kilobot, "controller"), "config");
    const auto found = controllers_.find(config);
    if (found == controllers_.end())
      throw UserError(fmt::format("{}:{}: <controller config=\"{}\">: is defined nowhere", name_,
                                  xml_.line_of(kilobot), config));
    return found->second.behaviour;
  }
  void range(pugi::xml_node kilobot) {
    const auto range_m = xml_.number(kilobot, "communication_range");
    if (!range_m) return;
    if (!experiment().radio().has_range_mm())
      experiment().mutable_radio()->set_range_mm(mm(*range_m));
    else if (experiment().radio().range_mm() != mm(*range_m))
      xml_.note(kilobot,
                fmt::format("has a range of its own, {:g} m; one range holds for all robots here", *range_m));
  }

  void robot(pugi::xml_node node) {
    const std::string behaviour = behaviour_of(node), id = xml_.text(node, "id");
    range(node);
    const pugi::xml_node at = child(node, "body");
    const auto position = xml_.triple(at, "position"), angles = xml_.triple(at, "orientation");
    const double heading_rad = angles[0] * kPi / 180;
    proto::RobotGroup* const group = group_of(behaviour);
    std::string& rows = rows_[behaviour];
    const std::size_t digits = id.find_last_not_of("0123456789") + 1;
    const int number = digits < id.size() && id.size() - digits < 6 ? std::stoi(id.substr(digits)) : -1;
    const auto count = static_cast<int>(std::count(rows.begin(), rows.end(), '\n'));
    if (number >= 0 && rows.empty()) group->set_first_uid(static_cast<std::uint32_t>(number));
    if (number >= 0 && !rows.empty() && number != static_cast<int>(group->first_uid()) + count)
      xml_.note(node, fmt::format("id=\"{}\": kilo_uid is {} here; numbers of a group are consecutive", id,
                                  static_cast<int>(group->first_uid()) + count));
    fmt::format_to(std::back_inserter(rows), "{:.3f},{:.3f},{:g}\n",
                   mm(position[0] - origin_[0]) + kAxleToCentre_mm * std::cos(heading_rad),
                   mm(position[1] - origin_[1]) + kAxleToCentre_mm * std::sin(heading_rad), angles[0]);
  }

  void distribute(pugi::xml_node node) {
    xml_.take(node);
    const pugi::xml_node entity = child(node, "entity"), position = child(node, "position"),
                         orientation = child(node, "orientation");
    const pugi::xml_node kilobot = child(entity, "kilobot");
    if (!kilobot) {
      xml_.take_all(node);
      xml_.note(node, "places other things than robots by chance; state their places as movable or obstacle");
      return;
    }
    proto::RobotGroup& group = *experiment().add_robots();
    group.set_count(static_cast<std::uint32_t>(xml_.number(entity, "quantity").value_or(1)));
    group.add_behaviour(behaviour_of(kilobot));
    (void)xml_.text(kilobot, "id");
    range(kilobot);
    if (const auto first = xml_.number(entity, "base_num")) group.set_first_uid(static_cast<std::uint32_t>(*first));
    layout(*group.mutable_layout(), position, orientation);
  }

  template <class Shape> void heading(Shape& shape, pugi::xml_node orientation) {
    const std::string method = xml_.text(orientation, "method");
    if (method == "constant") {
      shape.set_heading(proto::HEADING_FIXED);
      shape.set_heading_deg(xml_.triple(orientation, "values")[0]);
    } else if (method == "gaussian" || method == "grid") {
      xml_.note(orientation, fmt::format("method=\"{}\": headings are drawn from all directions here", method));
      (void)xml_.triple(orientation, "mean");
      (void)xml_.triple(orientation, "std_dev");
    } else {
      const auto least = xml_.triple(orientation, "min"), most = xml_.triple(orientation, "max");
      if (most[0] - least[0] < 360 && most[0] != least[0])
        xml_.note(orientation, "headings are drawn from all directions here");
    }
  }

  void centre(proto::Layout& layout, double x_m, double y_m) {
    if (x_m != origin_[0]) layout.set_x_mm(mm(x_m - origin_[0]));
    if (y_m != origin_[1]) layout.set_y_mm(mm(y_m - origin_[1]));
  }

  void layout(proto::Layout& layout, pugi::xml_node position, pugi::xml_node orientation) {
    const std::string method = xml_.text(position, "method");
    if (method == "grid") {
      const auto middle = xml_.triple(position, "center"), distance = xml_.triple(position, "distances"),
                 counts = xml_.triple(position, "layout");
      centre(layout, middle[0], middle[1]);
      layout.mutable_grid()->set_pitch_mm(mm(distance[0]));
      layout.mutable_grid()->set_columns(static_cast<std::uint32_t>(counts[0]));
      if (distance[0] != distance[1]) xml_.note(position, "has two distances; the first was taken for both");
      heading(*layout.mutable_grid(), orientation);
      return;
    }
    proto::RandomLayout& random = *layout.mutable_random();
    if (method == "uniform") {
      const auto least = xml_.triple(position, "min"), most = xml_.triple(position, "max");
      centre(layout, (least[0] + most[0]) / 2, (least[1] + most[1]) / 2);
      random.set_width_mm(mm(most[0] - least[0]));
      random.set_height_mm(mm(most[1] - least[1]));
    } else if (method == "gaussian") {
      const auto mean = xml_.triple(position, "mean"), sd = xml_.triple(position, "std_dev");
      centre(layout, mean[0], mean[1]);
      // The rectangle with the same variance.
      random.set_width_mm(mm(std::sqrt(12.0) * sd[0]));
      random.set_height_mm(mm(std::sqrt(12.0) * sd[1]));
      xml_.note(position,
                "method=\"gaussian\": became uniform with the same variance; a table of poses can be exact");
    } else if (method == "constant") {
      const auto at = xml_.triple(position, "values");
      centre(layout, at[0], at[1]);
      layout.mutable_grid();
      heading(*layout.mutable_grid(), orientation);
      return;
    } else {
      xml_.note(position, fmt::format("method=\"{}\": is not known; robots stand anywhere in the arena", method));
    }
    heading(random, orientation);
  }

  void engines(pugi::xml_node node) {
    int number = 0;
    for (const pugi::xml_node engine : node.children()) {
      if (engine.type() != pugi::node_element) continue;
      const std::string_view name = engine.name();
      if (name == "dynamics3d") experiment().mutable_physics()->set_engine(proto::Physics::ODE);
      if (name == "pointmass3d") experiment().mutable_physics()->set_engine(proto::Physics::KINEMATIC);
      if (name == "dynamics2d" || name == "dynamics3d" || name == "pointmass3d") {
        xml_.take(engine);
        if (++number == 2) xml_.note(engine, "several engines: give --partitions, such as 2x1");
        if (const pugi::xml_node bounds = engine.child("boundaries")) {
          xml_.take_all(bounds);
          if (number == 1) xml_.note(bounds, "walls of the engine: state them as arena { polygon }");
        }
      }
    }
  }

  void media(pugi::xml_node node) {
    const pugi::xml_node radio = child(node, "kilobot_communication");
    if (const auto loss = xml_.number(radio, "message_drop_prob"); loss && *loss > 0)
      experiment().mutable_radio()->set_loss(*loss);
    if (xml_.text(radio, "ignore_conflicts") == "true") {
      experiment().mutable_radio()->set_model(proto::Radio::SIMPLE);
      experiment().mutable_radio()->mutable_simple()->set_contention(0);
    }
  }

  XmlSource xml_;
  const std::string name_;
  Imported imported_;
  std::array<double, 2> origin_{};  ///< the arena's centre in ARGoS, m
  std::map<std::string, Controller> controllers_;
  std::map<std::string, int> group_index_;   // of robots whose poses are stated, by program
  std::map<std::string, std::string> rows_;  // their poses
  std::vector<std::size_t> walls_;
};

}  // namespace

Imported from_argos(std::string_view text, const std::string& name) { return ArgosImport(text, name).result(); }

}  // namespace kilotwin::importers
