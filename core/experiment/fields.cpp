#include "core/experiment/fields.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <vector>

#include "core/experiment/limits.hpp"
#include "idl/door.pb.h"
#include "idl/experiment.pb.h"
#include "idl/model.pb.h"

namespace kilotwin {
namespace pb = google::protobuf;

namespace {

using pb::FieldDescriptor;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
/// Poses stay within the largest arena, times within the longest run.
constexpr double kLongest_mm = 1e6, kLongest_s = 1e6;
/// Largest magnitude of the numbers in functions of effects.
constexpr double kLargestValue = 1e6;

constexpr FieldRule kRules[] = {
    {"Experiment.duration_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"Experiment.seed", -kUnlimited, kUnlimited, ""},
    {"Experiment.run_number", 0, kMostRobots, ""},
    {"Experiment.tick_cycles", 32768, 1048576, "cycles"},

    {"Arena.width_mm", 40, kLongest_mm, "mm"},
    {"Arena.height_mm", 40, kLongest_mm, "mm"},

    {"CircleArena.radius_mm", 20, kLongest_mm / 2, "mm"},
    {"Polygon.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Polygon.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Polygon.height_mm", 1, 1000, "mm"},
    {"Box.width_mm", 1, 1e5, "mm"},
    {"Box.length_mm", 1, 1e5, "mm"},
    {"Box.height_mm", 1, 1000, "mm"},
    {"Cylinder.radius_mm", 1, 1e5, "mm"},
    {"Cylinder.height_mm", 1, 1000, "mm"},
    {"MovableBody.mass_g", 0.1, 1e5, "g"},
    {"MovableBody.friction", 0, 2, ""},
    {"MovableBody.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"MovableBody.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"MovableBody.heading_deg", -360, 360, "degrees"},
    {"Obstacle.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Obstacle.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Obstacle.heading_deg", -360, 360, "degrees"},

    {"RobotGroup.count", 1, kMostRobots, "robots"},
    {"Layout.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Layout.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"GridLayout.pitch_mm", 2 * kRobotRadius_mm, kLongest_mm, "mm"},
    {"GridLayout.columns", 0, kMostRobots, "robots"},
    {"GridLayout.heading_deg", -360, 360, "degrees"},
    {"RingsLayout.count", 1, kMostRobots, "robots"},
    {"RingsLayout.radius_mm", 0, kLongest_mm, "mm"},
    {"RingsLayout.heading_deg", -360, 360, "degrees"},
    {"RandomLayout.width_mm", 2 * kRobotRadius_mm, kLongest_mm, "mm"},
    {"RandomLayout.height_mm", 2 * kRobotRadius_mm, kLongest_mm, "mm"},
    {"RandomLayout.min_gap_mm", 0, kLongest_mm, "mm"},
    {"RandomLayout.heading_deg", -360, 360, "degrees"},

    // Speeds and biases up to about ten times those of real robots.
    {"Motion.straight_speed_mm_s", 0, 200, "mm/s"},
    {"Motion.turn_speed_mm_s", 0, 200, "mm/s"},
    {"Motion.wheel_base_mm", 0, 100, "mm", Lower::kExcluded},
    {"Motion.axle_offset_mm", -kRobotRadius_mm, kRobotRadius_mm, "mm"},
    {"Motion.bias_mean_mm_s", -20, 20, "mm/s"},
    {"Motion.bias_sd_mm_s", 0, 20, "mm/s"},
    {"Motion.factor_variance_s", 0, 10, "s"},
    {"Motion.calibrated_straight_duty", 1, 255, ""},
    {"Motion.calibrated_turn_duty", 1, 255, ""},
    {"Motion.dead_band_duty", 0, 254, ""},
    {"Motion.duty_slope", 0, 20, ""},
    {"Motion.top_speed_ratio", 1, 10, ""},
    {"Motion.spin_up_s", 0, 0.1, "s"},
    {"Motion.effects_limit_mm_s", 0, 200, "mm/s"},
    {"RobotModel.robot", 0, kMostRobots - 1, ""},
    {"RobotModel.bias_left_mm_s", -100, 100, "mm/s"},
    {"RobotModel.bias_right_mm_s", -100, 100, "mm/s"},
    {"RobotModel.turn_left", 1, 255, ""},
    {"RobotModel.turn_right", 1, 255, ""},
    {"RobotModel.straight_left", 1, 255, ""},
    {"RobotModel.straight_right", 1, 255, ""},

    {"Effect.direction_deg", -360, 360, "degrees"},
    {"Effect.robot", 0, kMostRobots - 1, ""},
    {"Function.radius_mm", 1, 2000, "mm"},
    {"Function.forget_s", 0, kLongest_s, "s"},
    {"Function.focus", 0, 16, ""},
    {"Function.toward_deg", -360, 360, "degrees"},
    {"Function.along_deg", -360, 360, "degrees"},
    {"Function.other_robot", 0, kMostRobots - 1, ""},
    {"MovingPoint.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"MovingPoint.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"MovingPoint.velocity_x_mm_s", -1000, 1000, "mm/s"},
    {"MovingPoint.velocity_y_mm_s", -1000, 1000, "mm/s"},
    {"MovingPoint.growth_mm_s", -1000, 1000, "mm/s"},
    {"Function.constant", -kLargestValue, kLargestValue, ""},
    {"Linear.at_zero", -kLargestValue, kLargestValue, ""},
    {"Linear.slope", -kLargestValue, kLargestValue, ""},
    {"Exponential.at_zero", -kLargestValue, kLargestValue, ""},
    {"Exponential.at_infinity", -kLargestValue, kLargestValue, ""},
    {"Exponential.scale", -kLargestValue, kLargestValue, ""},
    {"Harmonic.mean", -kLargestValue, kLargestValue, ""},
    {"Harmonic.cosine", -kLargestValue, kLargestValue, ""},
    {"Harmonic.sine", -kLargestValue, kLargestValue, ""},
    {"Harmonic.period", 0, kLargestValue, "", Lower::kExcluded},
    {"Spline.knot", -kLargestValue, kLargestValue, ""},
    {"Spline.value", -kLargestValue, kLargestValue, ""},
    {"Spline2d.knot", -kLargestValue, kLargestValue, ""},
    {"Spline2d.and_knot", -kLargestValue, kLargestValue, ""},
    {"Spline2d.value", -kLargestValue, kLargestValue, ""},
    {"Steps.at", -kLargestValue, kLargestValue, ""},
    {"Steps.value", -kLargestValue, kLargestValue, ""},
    {"Table.key", 0, kMostRobots, ""},
    {"Table.value", -kLargestValue, kLargestValue, ""},
    {"Table.otherwise", -kLargestValue, kLargestValue, ""},
    {"Noise.sd", 0, kLargestValue, ""},
    {"Noise.correlation_s", 0, kLongest_s, "s"},
    {"Episodes.mean_apart_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"Episodes.scale_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"Episodes.tail", 0.1, kLargestValue, ""},
    {"Episodes.longest_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"Episodes.shape", 0.1, 100, ""},
    {"ArenaField.cell_mm", 10, kLongest_mm, "mm"},
    {"ArenaField.forget_s", 0, kLongest_s, "s"},
    {"ArenaField.corner_x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"ArenaField.corner_y_mm", -kLongest_mm, kLongest_mm, "mm"},

    {"Physics.sub_steps", 1, 4, ""},
    {"Physics.tilt_deg", 0, 45, "degrees"},
    {"Physics.downhill_deg", -360, 360, "degrees"},
    {"Physics.thrust_N", 0, 10, "N"},
    {"Physics.robot_mass_g", 1, 1000, "g"},
    {"Physics.robot_friction", 0, 2, ""},
    {"Physics.rim_friction", 0, 100, ""},

    {"Radio.range_mm", 2 * kRobotRadius_mm, kUnlimited, "mm", Lower::kExcluded},
    {"Radio.oscillator_sd", 0, 0.05, ""},
    {"Radio.loss", 0, 1, ""},
    {"Propagation.decay_db_per_mm", 0.01, 10, "dB/mm"},
    {"Propagation.power_sd_db", 0, 20, "dB"},
    {"Propagation.sensitivity_sd_db", 0, 20, "dB"},
    {"Propagation.power_bearing_sd_db", 0, 20, "dB"},
    {"Propagation.sensitivity_bearing_sd_db", 0, 20, "dB"},
    {"Propagation.body_loss_db", 0, 100, "dB"},
    {"Propagation.link_sd_db", 0, 20, "dB"},
    {"Propagation.packet_sd_db", 0, 20, "dB"},
    {"Propagation.capture_db", 0, 100, "dB"},
    {"Propagation.notice_db", 0, 20, "dB"},
    {"Propagation.pair_sd_db", 0, 20, "dB"},
    {"Propagation.run_sd_db", 0, 20, "dB"},
    {"Propagation.power_pattern_db", -100, 100, "dB"},
    {"Propagation.sensitivity_pattern_db", -100, 100, "dB"},
    {"Propagation.reading_sd_db", 0, 20, "dB"},
    {"Propagation.calibration_sd_db", 0, 20, "dB"},
    {"Propagation.range_mm", 2 * kRobotRadius_mm, kUnlimited, "mm", Lower::kExcluded},
    {"Propagation.oscillator_sd", 0, 0.05, ""},
    {"SimpleRadio.interval_s", 0, kLongest_s, "s"},
    {"SimpleRadio.sending_error", 0, 1, ""},
    {"SimpleRadio.drop_probability", 0, 1, ""},
    {"SimpleRadio.contention", 0, 1, ""},
    {"RobotRadio.robot", 0, kMostRobots - 1, ""},
    {"RobotRadio.power_db", -100, 100, "dB"},
    {"RobotRadio.sensitivity_db", -100, 100, "dB"},
    {"RobotRadio.power_ahead_db", -100, 100, "dB"},
    {"RobotRadio.power_left_db", -100, 100, "dB"},
    {"RobotRadio.sensitivity_ahead_db", -100, 100, "dB"},
    {"RobotRadio.sensitivity_left_db", -100, 100, "dB"},
    {"RobotRadio.oscillator", -0.1, 0.1, ""},
    {"RobotRadio.ir_high", 0, 1023, ""},
    {"RobotRadio.ir_low", 0, 1023, ""},
    {"RadioLink.sender", 0, kMostRobots - 1, ""},
    {"RadioLink.receiver", 0, kMostRobots - 1, ""},
    {"RadioLink.offset_db", -100, 100, "dB"},

    {"Station.start_broadcast_s", 0.05, 10, "s"},
    {"Station.packet_interval_s", 0, kLongest_s, "s"},
    {"Station.robot_interval_s", 0, kLongest_s, "s"},
    {"Station.log_every_s", 0, kLongest_s, "s"},
    {"Station.floor_every_s", 0, kLongest_s, "s"},
    {"Camera.frame_rate_hz", 0.1, 1000, "Hz"},
    {"Camera.latency_s", 0, 10, "s"},
    {"Camera.position_noise_mm", 0, 1000, "mm"},
    {"Camera.led_error", 0, 1, ""},
    {"Camera.dropped_frames", 0, 0.99, ""},
    {"Camera.losses_per_hour", 0, 3600, ""},
    {"Camera.lost_s", 0.01, 3600, "s"},
    {"Camera.swap_distance_mm", 0, 1000, "mm"},
    {"Camera.swaps_per_hour", 0, 36000, ""},
    {"BitField.first", 0, 13, ""},
    {"BitField.count", 1, 14, ""},
    {"HubEnvironment.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"HubEnvironment.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"HubEnvironment.radius_mm", 0, kUnlimited, "mm", Lower::kExcluded},
    {"ForagingEnvironment.home_x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"ForagingEnvironment.home_y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"ForagingEnvironment.home_radius_mm", 0, kUnlimited, "mm", Lower::kExcluded},
    {"ForagingEnvironment.food_x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"ForagingEnvironment.food_y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"ForagingEnvironment.food_radius_mm", 0, kUnlimited, "mm", Lower::kExcluded},
    {"ForagingEnvironment.scent_radius_mm", 0, kUnlimited, "mm"},
    {"ForagingEnvironment.loads", 1, 100000, ""},

    {"RobotGroup.first_uid", 0, 65535, ""},
    {"RobotModel.light_gain", 0, 10, ""},
    {"RobotModel.light_offset", -1023, 1023, "counts"},
    {"Light.ambient", 0, 1023, "counts"},
    {"LightSource.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightSource.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightSource.height_mm", 0, kLongest_mm, "mm"},
    {"LightSource.intensity", 0, 1e9, "counts"},
    {"LightSource.switch_s", 0, kLongest_s, "s"},
    {"LightSource.switch_period_s", 0, kLongest_s, "s"},
    {"LightCircle.radius_mm", 0, kLongest_mm, "mm"},
    {"LightCircle.period_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"LightCircle.phase_deg", -360, 360, "degrees"},
    {"LightWaypoint.time_s", 0, kLongest_s, "s"},
    {"LightWaypoint.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightWaypoint.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightWaypoint.height_mm", 0, kLongest_mm, "mm"},
    {"LightImage.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightImage.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"LightImage.width_mm", 0, kLongest_mm, "mm", Lower::kExcluded},
    {"LightImage.height_mm", 0, kLongest_mm, "mm", Lower::kExcluded},
    {"LightImage.black", 0, 1023, "counts"},
    {"LightImage.white", 0, 1023, "counts"},
    {"LightImage.gamma", 0.1, 10, ""},
    {"LightImage.picture_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"LightSensor.radius_mm", 0, kRobotRadius_mm, "mm"},
    {"LightSensor.angle_deg", -360, 360, "degrees"},
    {"LightSensor.tilt_deg", 0, 90, "degrees"},
    {"LightSensor.height_mm", 0, 100, "mm"},
    {"LightSensor.body_height_mm", 0, 100, "mm"},
    {"LightSensor.gain_sd", 0, 1, ""},
    {"LightSensor.offset_sd", 0, 1023, "counts"},
    {"LightSensor.noise_floor", 0, 1023, "counts"},
    {"LightSensor.noise_relative", 0, 1, ""},
    {"Battery.capacity_mAh", 0, 10000, "mAh", Lower::kExcluded},
    {"Battery.charge", 0, 1, ""},
    {"Battery.charge_sd", 0, 1, ""},
    {"Battery.idle_mA", 0, 1000, "mA"},
    {"Battery.sleep_mA", 0, 1000, "mA"},
    {"Battery.motor_mA", 0, 1000, "mA"},
    {"Battery.led_mA", 0, 1000, "mA"},
    {"Battery.transmission_mA", 0, 1000, "mA"},
    {"Battery.resistance_ohm", 0, 10, "ohm"},
    {"Battery.reading_sd", 0, 100, "counts"},
    {"Charger.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Charger.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Charger.radius_mm", 0, kLongest_mm, "mm", Lower::kExcluded},
    {"Charger.current_mA", 0, 1000, "mA"},
    {"Temperature.celsius", -40, 85, "degrees"},
    {"Temperature.offset_sd", 0, 50, "degrees"},
    {"Temperature.reading_sd", 0, 100, "counts"},

    {"Tracker.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Tracker.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Tracker.heading_deg", -360, 360, "degrees"},
    {"Tracker.scale", 1e-6, 1e6, "mm per unit"},
    {"Tracker.first_robot", 0, kMostRobots - 1, ""},
    {"Tracker.position_sd_mm", 0.01, 1000, "mm"},
    {"Tracker.heading_sd_deg", 0.01, 360, "degrees"},
    {"Tracking.bridge_s", 0.05, 3600, "s"},
    {"Tracking.speed_change_mm_s", 0.1, 1000, "mm/s"},
    {"Tracking.turn_change_deg_s", 0.1, 3600, "degrees/s"},
    {"SaysRule.robot", 0, kMostRobots - 1, ""},
    {"SaysRule.led", 0, 3, ""},
    {"SaysRule.data", 0, 255, ""},
    {"SaysRule.type", 0, 127, ""},
    {"SaysRule.id_octet", 0, 8, ""},
    {"SaysRule.period_s", 0.01, 8, "s"},
    {"HearsSimulated.range_mm", 0, 1000, "mm", Lower::kExcluded},
    {"HearsSimulated.type", 0, 15, ""},
    {"HearsSimulated.octet", 0, 8, ""},
    {"CircleRegion.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"CircleRegion.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"CircleRegion.radius_mm", 0, kLongest_mm, "mm", Lower::kExcluded},

    {"Recording.every_s", 0, kLongest_s, "s", Lower::kExcluded},
    {"RecordedVariable.every_s", 0, kLongest_s, "s", Lower::kExcluded},

    {"Door.position_sd_mm", 0, 1000, "mm", Lower::kExcluded},
    {"Door.heading_sd_deg", 0, 180, "degrees", Lower::kExcluded},
    {"DoorRobots.first_number", 0, kUnlimited, ""},
    {"DoorRobots.first_robot", 0, kMostRobots - 1, ""},
    {"NamedRobot.robot", 0, kMostRobots - 1, ""},
    {"Placement.x_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Placement.y_mm", -kLongest_mm, kLongest_mm, "mm"},
    {"Placement.turn_deg", -360, 360, "degrees"},
    {"Placement.unit_mm", 0, 1e6, "mm", Lower::kExcluded},
    {"Placement.heading_offset_deg", -360, 360, "degrees"},
    {"Ros2Door.domain", 0, 230, ""},
    {"Ros2Door.gather_ms", 0, 1000, "ms"},
    {"Ros2Door.max_tilt_deg", 0, 180, "degrees"},
    {"ArkDoor.interval_ms", 10, 10000, "ms"},
    {"ArkDoor.frame_rate_hz", 0, 1000, "Hz", Lower::kExcluded},
    {"ListenerDoor.robot", 0, kMostRobots - 1, ""},
    {"ListenerDoor.id_octet", 0, 8, ""},
    {"LogDoor.columns", 3, 6, ""},
    {"LogDoor.time_unit_s", 0, 3600, "s", Lower::kExcluded},

    {"Deployment.partition_columns", 1, 64, ""},
    {"Deployment.partition_rows", 1, 64, ""},
    {"Deployment.hosts", 1, 64, ""},
    {"Deployment.checkpoint_every_s", 0, kLongest_s, "s"},
};

using RuleTable = std::map<const FieldDescriptor*, const FieldRule*>;

RuleTable rules_by_field() {
  const pb::FileDescriptor* const files[] = {proto::Experiment::descriptor()->file(),
                                             proto::Door::descriptor()->file(), proto::Model::descriptor()->file(),
                                             proto::Effect::descriptor()->file()};
  RuleTable table;
  for (const FieldRule& rule : kRules) {
    const std::size_t dot = rule.field.find('.');
    for (const pb::FileDescriptor* file : files) {
      const pb::Descriptor* type = file->FindMessageTypeByName(std::string{rule.field.substr(0, dot)});
      if (type == nullptr) continue;
      if (const FieldDescriptor* field = type->FindFieldByName(std::string{rule.field.substr(dot + 1)}))
        table[field] = &rule;
    }
  }
  return table;
}

/// Edit distance of Damerau and Levenshtein: a swap of adjacent characters counts as one edit.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      next[j] = std::min({row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        next[j] = std::min(next[j], before[j - 2] + 1);
    }
    before.swap(row);
    row.swap(next);
  }
  return row[b.size()];
}

}  // namespace

std::span<const FieldRule> field_rules() { return kRules; }

const FieldRule* rule_of(const FieldDescriptor& field) {
  static const RuleTable table = rules_by_field();
  const auto found = table.find(&field);
  return found == table.end() ? nullptr : found->second;
}

std::string number_text(double value) { return fmt::format("{:.15g}", value); }

std::string range_text(const FieldRule& rule) {
  if (rule.min == -kUnlimited && rule.max == kUnlimited) return "any";
  const bool open = rule.lower == Lower::kExcluded;
  const std::string min = number_text(rule.min), max = number_text(rule.max);
  if (rule.max == kUnlimited) return (open ? "above " : "at least ") + min;
  return open ? fmt::format("above {}, at most {}", min, max) : fmt::format("{}..{}", min, max);
}

std::string value_text(const FieldDescriptor& field) {
  std::string text;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: return fmt::format("a block, {} {{ ... }}", field.name());
    case FieldDescriptor::CPPTYPE_BOOL: return "true or false";
    case FieldDescriptor::CPPTYPE_STRING: return "text in quotes";
    case FieldDescriptor::CPPTYPE_ENUM:
      text = field.enum_type()->value_count() > 1 ? "one of " : "";
      for (int i = 0; i < field.enum_type()->value_count(); ++i)
        text += (i ? ", " : "") + field.enum_type()->value(i)->name();
      return text;
    case FieldDescriptor::CPPTYPE_DOUBLE: text = "a number"; break;
    default: text = "a whole number"; break;
  }
  const FieldRule* const rule = rule_of(field);
  if (rule == nullptr || range_text(*rule) == "any") return text;
  return fmt::format("{}, {}{}{}", text, range_text(*rule), rule->unit.empty() ? "" : " ", rule->unit);
}

std::string default_text(const FieldDescriptor& field) {
  if (!field.has_default_value()) return "";
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL: return field.default_value_bool() ? "true" : "false";
    case FieldDescriptor::CPPTYPE_STRING: return field.default_value_string();
    case FieldDescriptor::CPPTYPE_ENUM: return field.default_value_enum()->name();
    case FieldDescriptor::CPPTYPE_UINT32: return std::to_string(field.default_value_uint32());
    case FieldDescriptor::CPPTYPE_UINT64: return std::to_string(field.default_value_uint64());
    case FieldDescriptor::CPPTYPE_DOUBLE: return number_text(field.default_value_double());
    default: return "";
  }
}

std::string field_names(const pb::Descriptor& type) {
  std::string names;
  for (int i = 0; i < type.field_count(); ++i) names += (i ? ", " : "") + type.field(i)->name();
  return names;
}

std::string field_suggestion(std::string_view wrong, const pb::Descriptor& type) {
  constexpr std::size_t kLongestName = 64;
  if (wrong.size() > kLongestName) return "its fields are " + field_names(type);
  std::string nearest;
  std::size_t best = std::max<std::size_t>(2, wrong.size() / 3) + 1;
  for (int i = 0; i < type.field_count(); ++i) {
    const std::size_t distance = edit_distance(wrong, type.field(i)->name());
    if (distance >= std::min(best, type.field(i)->name().size())) continue;
    best = distance;
    nearest = type.field(i)->name();
  }
  return nearest.empty() ? "its fields are " + field_names(type) : fmt::format("did you mean {}?", nearest);
}

}  // namespace kilotwin
