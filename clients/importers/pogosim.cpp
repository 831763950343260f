// Configurations of pogosim, the simulator of Pogobots. docs/how-to/from-pogosim.md lists what becomes of each key.
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "clients/importers/imported.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/csv/csv_reader.hpp"

namespace kilotwin::importers {
namespace {

/// Why a key of the top level or of an object has no counterpart; empty: none is reported.
const std::map<std::string, std::string>& reasons_of_keys() {
  static const std::map<std::string, std::string> all{
      {"time_step", "a tick is 32.768 ms, the firmware's own"},
      {"GUI", "kilotwin view shows a run in a browser"},
      {"GUI_speed_up", ""},
      {"window_width", ""},
      {"window_height", ""},
      {"show_time", ""},
      {"show_scale_bar", ""},
      {"show_communication_channels", ""},
      {"show_communication_channels_above_all", ""},
      {"show_lateral_LEDs", ""},
      {"show_light_levels", ""},
      {"delete_old_files", ""},
      {"enable_data_logging", ""},
      {"data_filename", "kilotwin export writes tables of a recorded run, .feather too"},
      {"enable_console_logging", ""},
      {"console_filename", "printf() of programs stands in the run directory"},
      {"save_video_period", "kilotwin movie makes one of a recorded run"},
      {"frames_name", ""},
      {"formation_cluster_at_center", ""},
      {"arena_temperature", "give temperature { } if the program reads it"},
      {"communication_ignore_occlusions", "bodies weaken signals where radio.model is PROPAGATION"},
      {"colormap", ""},
      {"geometry", ""},
      {"body_linear_damping", "friction on the floor stops bodies here"},
      {"body_angular_damping", ""},
      {"body_density", "robots have the mass of Kilobots"},
      {"body_friction", ""},
      {"body_restitution", "collisions are inelastic, as of robots that walk"},
      {"linear_noise_stddev", "noise of the wheels is motion.wheel_factor_sd here; see kilotwin identify"},
      {"angular_noise_stddev", ""},
      {"photosensors_systematic_bias_domain", "see light.sensor"},
      {"photosensors_noise_stddev", "see light.sensor"},
      {"max_angular_speed", "a Kilobot's wheels are 25 mm apart: motion.turn_speed_mm_s"},
  };
  return all;
}

constexpr double kKilobot_mm = 16.5;

class PogosimImport {
 public:
  PogosimImport(std::string_view text, const std::string& name, ReadNamed read)
      : name_(name), read_file_(std::move(read)) {
    try {
      root_ = YAML::Load(std::string(text));
    } catch (const YAML::Exception& error) {
      throw UserError(fmt::format("{}:{}:{}: {}", name, error.mark.line + 1, error.mark.column + 1, error.msg));
    }
    if (!root_.IsMap() || !root_["objects"] || !root_["objects"].IsMap())
      throw UserError(
          fmt::format("{}: has no \"objects:\"; a configuration of pogosim lists its robots there", name_));
  }

  Imported result() {
    top();
    arena();
    for (const auto& object : root_["objects"]) category(object.first.as<std::string>(), object.second);
    if (experiment().robots().empty()) throw UserError(fmt::format("{}: no object is a pogobot", name_));
    parameters();
    leftovers(root_, read_);
    std::stable_sort(notes_.begin(), notes_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [line, note] : notes_) imported_.notes.push_back(fmt::format("{}: {}", line, note));
    return std::move(imported_);
  }

 private:
  proto::Experiment& experiment() { return imported_.experiment; }
  void note(const YAML::Node& at, const std::string& text) { notes_.emplace_back(at.Mark().line + 1, text); }

  /// A value of pogosim, which may be a list of values for a batch: then its first one.
  YAML::Node single(const YAML::Node& value, const std::string& key) {
    if (!value.IsMap() || !value["batch_options"]) return value;
    const YAML::Node options = value["batch_options"];
    std::string values;
    for (const auto& option : options)
      values += (values.empty() ? "" : ",") + (option.IsScalar() ? option.as<std::string>() : std::string("..."));
    note(value, fmt::format("{}: is a batch over {}; the first was taken, and kilotwin sweep --set runs all", key,
                            values));
    return options[0] ? options[0] : value;
  }
  /// A number of a map, which counts as read.
  std::optional<double> number(const YAML::Node& map, const std::string& key, std::set<std::string>& read) {
    if (!map[key]) return std::nullopt;
    read.insert(key);
    const YAML::Node value = single(map[key], key);
    double result = 0;
    if (!value.IsScalar() || !YAML::convert<double>::decode(value, result) || !std::isfinite(result))
      throw UserError(fmt::format("{}:{}: {}: expected a number", name_, value.Mark().line + 1, key));
    return result;
  }
  std::optional<std::string> text(const YAML::Node& map, const std::string& key, std::set<std::string>& read) {
    if (!map[key]) return std::nullopt;
    read.insert(key);
    const YAML::Node value = single(map[key], key);
    if (!value.IsScalar())
      throw UserError(fmt::format("{}:{}: {}: expected a text", name_, value.Mark().line + 1, key));
    return value.as<std::string>();
  }

  void top() {
    const double duration_s = number(root_, "simulation_time", read_).value_or(0);
    experiment().set_duration_s(duration_s > 0 ? duration_s : 600);
    if (const auto seed = number(root_, "seed", read_); seed && *seed >= 0 && *seed <= 0x1p53)
      experiment().set_seed(static_cast<std::uint64_t>(*seed));
    if (const auto every_s = number(root_, "save_data_period", read_); every_s && *every_s > 0)
      experiment().mutable_recording()->set_every_s(*every_s);
    if (const auto edge = text(root_, "boundary_condition", read_); edge && *edge != "solid")
      note(root_["boundary_condition"], fmt::format("boundary_condition: {}: the arena has walls here", *edge));
  }

  void arena() {
    area_mm2_ = number(root_, "arena_surface", read_).value_or(1e6);
    if (area_mm2_ <= 0) throw UserError(fmt::format("{}: arena_surface: expected more than 0", name_));
    const std::string file = text(root_, "arena_file", read_).value_or("arenas/disk.csv");
    const std::string shape = file.substr(file.find_last_of('/') + 1);
    half_mm_ = std::sqrt(area_mm2_) / 2;
    if (shape == "disk.csv") {
      half_mm_ = std::round(std::sqrt(area_mm2_ / kPi) * 10) / 10;
      experiment().mutable_arena()->mutable_circle()->set_radius_mm(half_mm_);
      return;
    }
    experiment().mutable_arena()->set_width_mm(std::round(20 * half_mm_) / 10);
    experiment().mutable_arena()->set_height_mm(std::round(20 * half_mm_) / 10);
    if (shape != "square.csv")
      note(root_["arena_file"],
           fmt::format("arena_file: {}: became a square of the same area; a convex shape can be "
                       "given as arena {{ polygon {{ }} }}, others by obstacles",
                       file));
  }

  void category(const std::string& name, const YAML::Node& object) {
    std::set<std::string> read;
    if (!object.IsMap())
      throw UserError(fmt::format("{}:{}: {}: expected keys", name_, object.Mark().line + 1, name));
    const std::string type = text(object, "type", read).value_or("pogobot");
    if (type == "pogobot") {
      robots(name, object, read);
    } else if (type == "passive_object") {
      passive(name, object, read);
    } else if (type == "static_light") {
      light(name, object, read);
    } else {
      note(object, fmt::format("{}: {} has no counterpart", name, type));
      return;
    }
    leftovers(object, read);
  }

  void robots(const std::string& name, const YAML::Node& object, std::set<std::string>& read) {
    const double count = number(object, "nb", read).value_or(1);
    constexpr double kMostRobots = 1e6;
    if (count < 1 || count > kMostRobots)
      throw UserError(fmt::format("{}: {}: nb: expected 1 to {:g}", name_, name, kMostRobots));
    proto::RobotGroup& group = *experiment().add_robots();
    group.set_count(static_cast<std::uint32_t>(count));
    group.add_behaviour("behaviour.c");
    if (const auto radius_mm = number(object, "radius", read); radius_mm && *radius_mm != kKilobot_mm)
      note(object["radius"],
           fmt::format("{}: radius: {:g} mm; Kilobots have {:g} mm, so scale distances and the arena", name,
                       *radius_mm, kKilobot_mm));
    if (const auto range_mm = number(object, "communication_radius", read)) {
      // pogosim measures from an emitter on the rim, Kilotwin between centres.
      if (!experiment().radio().has_range_mm())
        experiment().mutable_radio()->set_range_mm(*range_mm + kKilobot_mm);
      else if (experiment().radio().range_mm() != *range_mm + kKilobot_mm)
        note(object["communication_radius"],
             name + ": communication_radius: one radio serves all; the first was taken");
    }
    if (const YAML::Node success = object["msg_success_rate"]) {
      read.insert("msg_success_rate");
      std::set<std::string> ignored;
      const auto kind = success.IsMap() ? text(success, "type", ignored) : std::nullopt;
      const double rate = success.IsMap() ? number(success, "rate", ignored).value_or(1) : 1;
      if (kind == "static" && rate < 1)
        experiment().mutable_radio()->set_loss(std::round((1 - rate) * 1e6) / 1e6);
      else if (kind == "dynamic")
        note(success,
             name + ": msg_success_rate: dynamic: packets that overlap are lost here, so density acts by itself");
    }
    if (const auto speed_mm_s = number(object, "max_linear_speed", read))
      experiment().mutable_motion()->set_straight_speed_mm_s(*speed_mm_s);
    layout(name, group);
    if (!program_told_)
      note(object, "the program's file is not named; it is taken to be behaviour.c, in C for kilolib");
    program_told_ = true;
  }

  void layout(const std::string& category, proto::RobotGroup& group) {
    proto::Layout& layout = *group.mutable_layout();
    const std::string formation = text(root_, "initial_formation", read_).value_or("power_lloyd");
    const double pitch_mm = number(root_, "chessboard_distance_between_neighbors", read_).value_or(50);
    const bool aligned = formation.starts_with("aligned_");
    const auto head = [aligned](auto& shape) {
      if (!aligned) return;
      shape.set_heading(proto::HEADING_FIXED);
      shape.set_heading_deg(90);
    };
    if (formation.ends_with("chessboard")) {
      layout.mutable_grid()->set_pitch_mm(pitch_mm);
      head(*layout.mutable_grid());
      return;
    }
    if (formation == "imported") return stated_poses(category, group);
    head(*layout.mutable_random());
    if (formation == "disk") {
      layout.mutable_random()->set_width_mm(std::round(half_mm_));
      layout.mutable_random()->set_height_mm(std::round(half_mm_));
    }
    if (!formation_told_ && formation != "random" && formation != "aligned_random" && root_["initial_formation"])
      note(root_["initial_formation"], fmt::format("initial_formation: {}: became random", formation));
    formation_told_ = true;
  }

  /// The groups take the rows of the table `formation_filename` in their order.
  void stated_poses(const std::string& category, proto::RobotGroup& group) {
    const std::string file = text(root_, "formation_filename", read_).value_or("");
    if (!formation_told_) read_formation(file);
    formation_told_ = true;
    PosesFile& poses = imported_.poses.emplace_back();
    poses.name = fmt::format("poses-{}.csv", imported_.poses.size());
    poses.text = "x_mm,y_mm,heading_deg\n";
    group.mutable_layout()->mutable_poses()->set_csv(poses.name);
    if (formation_.empty()) return imported_.poses.pop_back();  // a note says what to do
    if (formation_.size() < next_pose_ + group.count())
      throw UserError(fmt::format("{}: has {} poses, too few for the {} robots of {}{}", file, formation_.size(),
                                  group.count(), category,
                                  next_pose_ > 0 ? fmt::format(" after {} others", next_pose_) : ""));
    for (std::uint32_t i = 0; i < group.count(); ++i) {
      const Pose& pose = formation_[next_pose_++];
      fmt::format_to(std::back_inserter(poses.text), "{:.10g},{:.10g},{:.6g}\n", pose.x_mm, pose.y_mm,
                     pose.heading_rad * 180 / kPi);
    }
  }

  /// Columns x, y, maybe theta or angle, and maybe time: then the rows of the earliest time count.
  void read_formation(const std::string& file) {
    const auto content = read_file_ && file.ends_with(".csv") ? read_file_(file) : std::nullopt;
    if (!content) {
      note(root_["initial_formation"], fmt::format("initial_formation: imported: \"{}\" is no CSV file that can be "
                                                   "read; save it as CSV, and import again",
                                                   file));
      return;
    }
    CsvReader csv(file, *content);
    csv.require({"x", "y"}, "the columns x and y, and maybe theta or angle, and time");
    const auto heading = csv.find_column("theta") ? csv.find_column("theta") : csv.find_column("angle");
    const auto time = csv.find_column("time");
    const Scale x = scale("x", 0), y = scale("y", 1);
    double earliest = std::numeric_limits<double>::infinity();
    bool no_heading = !heading;
    while (csv.next()) {
      const double at_x = csv.number_or_nan(csv.column("x")), at_y = csv.number_or_nan(csv.column("y"));
      const double at_s = time ? csv.number(*time) : 0;
      if (std::isnan(at_x) || std::isnan(at_y) || at_s > earliest) continue;
      if (at_s < earliest) formation_.clear();
      earliest = at_s;
      const double angle = heading ? csv.number_or_nan(*heading) : std::nan("");
      no_heading = no_heading || std::isnan(angle);
      formation_.push_back({x(at_x) - half_mm_, y(at_y) - half_mm_, std::isnan(angle) ? 0 : angle});
    }
    if (formation_.empty()) throw UserError(file + ": holds no pose");
    if (no_heading)
      note(root_["initial_formation"],
           fmt::format("initial_formation: {} lacks angles, which are random there; they are 0 here", file));
  }

  /// The coordinates of a table of poses: as they are, or stretched from given bounds to those of the arena.
  struct Scale {
    double from = 0, by = 1;
    double operator()(double value) const { return (value - from) * by; }
  };
  Scale scale(const char* axis, std::size_t index) {
    const auto bound = [&](const char* key) -> double {
      read_.insert(key);
      const YAML::Node pair = root_[key];
      double value = std::nan("");
      if (pair && pair.IsSequence() && pair.size() == 2)
        static_cast<void>(YAML::convert<double>::decode(pair[index], value));
      return value;
    };
    const double low = bound("imported_formation_min_coords"), high = bound("imported_formation_max_coords");
    if (!std::isfinite(low) || !std::isfinite(high)) return {};
    if (high <= low)
      throw UserError(fmt::format(
          "{}: imported_formation_max_coords: {} is not above that of imported_formation_min_coords", name_, axis));
    return {low, 2 * half_mm_ / (high - low)};
  }

  /// Millimetres from pogosim's corner to the arena's centre.
  double centred(const std::optional<double>& mm) const { return mm ? *mm - half_mm_ : 0; }

  void passive(const std::string& name, const YAML::Node& object, std::set<std::string>& read) {
    const double count = number(object, "nb", read).value_or(1);
    const auto x = number(object, "x", read), y = number(object, "y", read);
    const auto radius_mm = number(object, "radius", read), width_mm = number(object, "body_width", read),
               length_mm = number(object, "body_height", read);
    if (!radius_mm && !(width_mm && length_mm)) return note(object, name + ": has no size, and was left out");
    constexpr double kMostBodies = 1000;
    for (int i = 0; i < std::min(count, kMostBodies); ++i) {
      proto::MovableBody& body = *experiment().add_movable();
      if (radius_mm) {
        body.mutable_cylinder()->set_radius_mm(*radius_mm);
      } else {
        body.mutable_box()->set_width_mm(*width_mm);
        body.mutable_box()->set_length_mm(*length_mm);
      }
      body.set_mass_g(18);
      // In a row, apart from each other.
      const double apart_mm = 10 + (radius_mm ? 2 * *radius_mm : *width_mm);
      body.set_x_mm(centred(x) + apart_mm * (i - (count - 1) / 2));
      body.set_y_mm(centred(y));
    }
    note(object, name + ": masses were taken as 18 g; give mass_g and places");
  }

  void light(const std::string& name, const YAML::Node& object, std::set<std::string>& read) {
    constexpr double kTheirs = 32767, kOurs = 1023;
    const double reading = number(object, "value", read).value_or(0) / kTheirs * kOurs;
    const auto x = number(object, "x", read), y = number(object, "y", read);
    for (const char* key :
         {"light_mode", "edge_value", "radius", "photo_start_at", "photo_start_duration", "photo_start_value"})
      if (object[key]) read.insert(key);
    if (object["geometry"] && object["geometry"].IsScalar() && object["geometry"].as<std::string>() == "global") {
      experiment().mutable_light()->set_ambient(std::round(reading * 10) / 10);
      if (object["photo_start_at"])
        note(object["photo_start_at"],
             name + ": photo_start_at: a run message starts Kilobots, and all start at once");
      return;
    }
    proto::LightSource& lamp = *experiment().mutable_light()->add_source();
    lamp.set_x_mm(centred(x));
    lamp.set_y_mm(centred(y));
    note(object,
         name + ": a spot of light became a lamp 300 mm above its centre; light { image { } } draws any pattern");
  }

  void parameters() {
    read_.insert("objects");
    if (!root_["parameters"]) return;
    read_.insert("parameters");
    if (!root_["parameters"].IsMap()) return;
    for (const auto& entry : root_["parameters"])
      note(entry.first, fmt::format("{}: is a parameter of the program; give --define, or state it there",
                                    entry.first.as<std::string>()));
  }

  void leftovers(const YAML::Node& map, const std::set<std::string>& read) {
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) continue;
      const auto key = entry.first.as<std::string>();
      if (read.contains(key)) continue;
      const auto reason = reasons_of_keys().find(key);
      if (reason == reasons_of_keys().end())
        note(entry.first, key + ": has no counterpart");
      else if (!reason->second.empty() && told_.insert(key).second)
        note(entry.first, key + ": " + reason->second);
    }
  }

  struct Pose {
    double x_mm = 0, y_mm = 0, heading_rad = 0;
  };

  const std::string name_;
  const ReadNamed read_file_;
  std::vector<Pose> formation_;  ///< from the arena's centre
  std::size_t next_pose_ = 0;    ///< the first that no group has
  YAML::Node root_;
  std::set<std::string> read_, told_;
  double area_mm2_ = 0, half_mm_ = 0;
  bool formation_told_ = false, program_told_ = false;
  std::vector<std::pair<int, std::string>> notes_;
  Imported imported_;
};

}  // namespace

Imported from_pogosim(std::string_view text, const std::string& name, const ReadNamed& read) {
  try {
    return PogosimImport(text, name, read).result();
  } catch (const YAML::Exception& error) {
    throw UserError(fmt::format("{}:{}: {}", name, error.mark.line + 1, error.msg));
  }
}

}  // namespace kilotwin::importers
