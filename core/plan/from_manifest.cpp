#include "core/plan/from_manifest.hpp"

#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>

#include "core/base/error.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

constexpr std::uint32_t kManifestFormat = 1;

void require(bool condition, const std::string& wrong, const char* right) {
  if (!condition) throw UserError("manifest: " + wrong + "; " + right);
}

template <class T> std::vector<T> list(const google::protobuf::RepeatedField<T>& field) {
  return {field.begin(), field.end()};
}

template <class Settings, class Message>
std::vector<Settings> each(const google::protobuf::RepeatedPtrField<Message>& messages,
                           Settings (*make)(const Message&)) {
  std::vector<Settings> all;
  all.reserve(static_cast<std::size_t>(messages.size()));
  for (const Message& message : messages) all.push_back(make(message));
  return all;
}

MotionSettings motion_of(const proto::Motion& motion) {
  MotionSettings out;
  out.noise = motion.noise();
  out.straight_speed_mm_s = motion.straight_speed_mm_s();
  out.turn_speed_mm_s = motion.turn_speed_mm_s();
  out.wheel_base_mm = motion.wheel_base_mm();
  out.axle_offset_mm = motion.axle_offset_mm();
  out.bias_mean_mm_s = motion.bias_mean_mm_s();
  out.bias_sd_mm_s = motion.bias_sd_mm_s();
  out.factor_variance_s = motion.factor_variance_s();
  out.calibrated_straight_duty = motion.calibrated_straight_duty();
  out.calibrated_turn_duty = motion.calibrated_turn_duty();
  out.dead_band_duty = motion.dead_band_duty();
  out.duty_slope = motion.duty_slope();
  out.top_speed_ratio = motion.top_speed_ratio();
  out.spin_up_s = motion.spin_up_s();
  out.effects_limit_mm_s = motion.effects_limit_mm_s();
  return out;
}

RobotSettings robot_of(const proto::RobotModel& robot) {
  RobotSettings out;
  out.robot = robot.robot();
  if (robot.has_bias_left_mm_s()) out.bias_left_mm_s = robot.bias_left_mm_s();
  if (robot.has_bias_right_mm_s()) out.bias_right_mm_s = robot.bias_right_mm_s();
  if (robot.has_turn_left()) out.turn_left = robot.turn_left();
  if (robot.has_turn_right()) out.turn_right = robot.turn_right();
  if (robot.has_straight_left()) out.straight_left = robot.straight_left();
  if (robot.has_straight_right()) out.straight_right = robot.straight_right();
  if (robot.has_light_gain()) out.light_gain = robot.light_gain();
  if (robot.has_light_offset()) out.light_offset = robot.light_offset();
  return out;
}

PhysicsSettings physics_of(const proto::Physics& physics) {
  PhysicsSettings out;
  switch (physics.engine()) {
    case proto::Physics::PLANAR: out.engine = PhysicsSettings::Engine::kPlanar; break;
    case proto::Physics::KINEMATIC: out.engine = PhysicsSettings::Engine::kKinematic; break;
    case proto::Physics::ODE: out.engine = PhysicsSettings::Engine::kOde; break;
  }
  out.sub_steps = physics.sub_steps();
  out.tilt_deg = physics.tilt_deg();
  out.downhill_deg = physics.downhill_deg();
  out.thrust_N = physics.thrust_n();
  out.robot_mass_g = physics.robot_mass_g();
  out.robot_friction = physics.robot_friction();
  out.rim_friction = physics.rim_friction();
  return out;
}

RobotRadioSettings robot_radio_of(const proto::RobotRadio& robot) {
  RobotRadioSettings out;
  out.robot = robot.robot();
  if (robot.has_power_db()) out.power_db = robot.power_db();
  if (robot.has_sensitivity_db()) out.sensitivity_db = robot.sensitivity_db();
  if (robot.has_power_ahead_db()) out.power_ahead_db = robot.power_ahead_db();
  if (robot.has_power_left_db()) out.power_left_db = robot.power_left_db();
  if (robot.has_sensitivity_ahead_db()) out.sensitivity_ahead_db = robot.sensitivity_ahead_db();
  if (robot.has_sensitivity_left_db()) out.sensitivity_left_db = robot.sensitivity_left_db();
  if (robot.has_oscillator()) out.oscillator = robot.oscillator();
  out.ir_high = list(robot.ir_high());
  out.ir_low = list(robot.ir_low());
  return out;
}

RadioLinkSettings link_of(const proto::RadioLink& link) {
  return {link.sender(), link.receiver(), link.offset_db()};
}

PropagationSettings propagation_of(const proto::Propagation& propagation) {
  PropagationSettings out;
  out.decay_db_per_mm = propagation.decay_db_per_mm();
  out.power_sd_db = propagation.power_sd_db();
  out.sensitivity_sd_db = propagation.sensitivity_sd_db();
  out.power_bearing_sd_db = propagation.power_bearing_sd_db();
  out.sensitivity_bearing_sd_db = propagation.sensitivity_bearing_sd_db();
  out.body_loss_db = propagation.body_loss_db();
  out.link_sd_db = propagation.link_sd_db();
  out.pair_sd_db = propagation.pair_sd_db();
  out.run_sd_db = propagation.run_sd_db();
  out.packet_sd_db = propagation.packet_sd_db();
  out.capture_db = propagation.capture_db();
  out.reading_sd_db = propagation.reading_sd_db();
  out.calibration_sd_db = propagation.calibration_sd_db();
  out.notice_db = propagation.notice_db();
  out.power_pattern_db = list(propagation.power_pattern_db());
  out.sensitivity_pattern_db = list(propagation.sensitivity_pattern_db());
  out.robots = each(propagation.robot(), robot_radio_of);
  out.links = each(propagation.link(), link_of);
  return out;
}

RadioSettings radio_of(const proto::Radio& radio) {
  RadioSettings out;
  switch (radio.model()) {
    case proto::Radio::PROPAGATION: out.model = RadioSettings::Model::kPropagation; break;
    case proto::Radio::DISC: out.model = RadioSettings::Model::kDisc; break;
    case proto::Radio::SIMPLE: out.model = RadioSettings::Model::kSimple; break;
  }
  out.range_mm = radio.range_mm();
  out.oscillator_sd = radio.oscillator_sd();
  out.loss = radio.loss();
  out.propagation = propagation_of(radio.propagation());
  const proto::SimpleRadio& simple = radio.simple();
  out.simple = {simple.interval_s(), simple.sending_error(), simple.drop_probability(), simple.contention()};
  return out;
}

StationSettings station_of(const proto::Manifest& manifest) {
  const proto::Station& station = manifest.experiment().station();
  StationSettings out;
  out.start_broadcast_s = station.start_broadcast_s();
  out.packet_interval_s = station.packet_interval_s();
  if (station.has_robot_interval_s()) out.robot_interval_s = station.robot_interval_s();
  out.log_every_s = station.log_every_s();
  out.floor_every_s = station.floor_every_s();
  if (station.has_camera()) {
    const proto::Camera& camera = station.camera();
    out.camera = {camera.frame_rate_hz(), camera.latency_s(),        camera.position_noise_mm(),
                  camera.led_error(),     camera.dropped_frames(),   camera.losses_per_hour(),
                  camera.lost_s(),        camera.swap_distance_mm(), camera.swaps_per_hour()};
  }
  out.environments = each<EnvironmentSettings>(station.environment(), settings_of);
  out.host_sha256 = manifest.station_host();
  for (std::size_t i = 0; i < out.environments.size(); ++i) {
    if (static_cast<int>(i) < manifest.station_plugin_size())
      out.environments[i].sha256 = manifest.station_plugin(static_cast<int>(i));
  }
  return out;
}

/// All fields as parameters of a built-in plugin, defaults included.
std::map<std::string, std::string> parameters_of(const google::protobuf::Message& message) {
  std::map<std::string, std::string> out;
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const google::protobuf::FieldDescriptor* const field = type.field(i);
    if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_UINT32) {
      out[field->name()] = std::to_string(message.GetReflection()->GetUInt32(message, field));
      continue;
    }
    std::array<char, 32> text{};
    const double value = message.GetReflection()->GetDouble(message, field);
    out[field->name()] = std::string(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
  }
  return out;
}

SaysRuleSettings rule_of(const proto::SaysRule& rule) {
  constexpr double kPeriodCount_s = 128e-6;
  SaysRuleSettings out;
  out.robots = list(rule.robot());
  std::sort(out.robots.begin(), out.robots.end());
  if (rule.has_circle()) out.circle = {rule.circle().x_mm(), rule.circle().y_mm(), rule.circle().radius_mm()};
  if (rule.led_size() == 3) out.led = static_cast<std::uint8_t>(rule.led(0) | rule.led(1) << 2 | rule.led(2) << 4);
  for (int i = 0; i < rule.data_size(); ++i)
    out.message[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(rule.data(i));
  out.message.back() = static_cast<std::uint8_t>(rule.type());
  if (rule.has_id_octet()) out.id_octet = rule.id_octet();
  out.tx_period = static_cast<std::uint16_t>(rule.period_s() / kPeriodCount_s);
  return out;
}

HearsSettings hears_of(const proto::HearsSimulated& hears) {
  return {hears.range_mm(), static_cast<std::uint8_t>(hears.type()), static_cast<HearsSettings::Data>(hears.data()),
          hears.octet()};
}

TrackingSettings tracking_of(const proto::Experiment& experiment) {
  constexpr double kDegree = kPi / 180;
  TrackingSettings out;
  for (const proto::Tracker& tracker : experiment.tracker()) {
    out.trackers.push_back({tracker.source(), tracker.x_mm(), tracker.y_mm(), tracker.heading_deg() * kDegree,
                            tracker.scale(), tracker.mirrored(), tracker.first_robot(), tracker.position_sd_mm(),
                            tracker.heading_sd_deg() * kDegree});
  }
  const proto::Tracking& tracking = experiment.tracking();
  out.bridge_s = tracking.bridge_s();
  out.present_at_start = tracking.start() == proto::Tracking::PRESENT;
  out.speed_change_mm_s = tracking.speed_change_mm_s();
  out.turn_change_rad_s = tracking.turn_change_deg_s() * kDegree;
  std::uint32_t first = 0;
  for (const proto::RobotGroup& group : experiment.robots()) {
    out.rules.push_back(each(group.says().rule(), rule_of));
    out.heard.push_back(group.says().heard() ? 1 : 0);
    out.hears.emplace_back();
    if (group.has_hears_simulated()) out.hears.back() = hears_of(group.hears_simulated());
    out.first_robots.push_back(first);
    first += group.count();
  }
  return out;
}

LightWaypointSettings waypoint_of(const proto::LightWaypoint& point) {
  LightWaypointSettings out{point.time_s(), point.x_mm(), point.y_mm(), {}};
  if (point.has_height_mm()) out.height_mm = point.height_mm();
  return out;
}

/// The image's pictures take their rasters from the manifest's list, in order, from index `first`.
LightImageSettings image_of(const proto::LightImage& image, const proto::Manifest& manifest, int first) {
  const proto::Arena& arena = manifest.experiment().arena();
  LightImageSettings out;
  out.x_mm = image.x_mm();
  out.y_mm = image.y_mm();
  out.black = image.black();
  out.white = image.white();
  out.gamma = image.gamma();
  out.picture_s = image.picture_s();
  out.loop = image.loop();
  out.width_mm = image.has_width_mm() ? image.width_mm() : arena.width_mm();
  out.height_mm = image.has_height_mm() ? image.height_mm() : arena.height_mm();
  for (int i = first; i < first + image.png_size(); ++i) {
    const proto::LightRaster& raster = manifest.light_raster(i);
    out.pictures.push_back({raster.columns(), raster.rows(), raster.brightness()});
  }
  return out;
}

LightSensorSettings sensor_of(const proto::LightSensor& sensor) {
  LightSensorSettings out;
  out.radius_mm = sensor.radius_mm();
  out.angle_deg = sensor.angle_deg();
  out.height_mm = sensor.height_mm();
  out.body_height_mm = sensor.body_height_mm();
  out.cosine = sensor.cosine();
  out.tilt_deg = sensor.tilt_deg();
  out.gain_sd = sensor.gain_sd();
  out.offset_sd = sensor.offset_sd();
  out.noise_floor = sensor.noise_floor();
  out.noise_relative = sensor.noise_relative();
  return out;
}

LightSettings light_of(const proto::Light& light, const proto::Manifest& manifest) {
  LightSettings out;
  out.ambient = light.ambient();
  out.shadows = light.shadows();
  out.sources = each<LightSourceSettings>(light.source(), settings_of);
  out.sensor = sensor_of(light.sensor());
  int rasters = 0;
  for (const proto::LightImage& image : light.image()) {
    out.images.push_back(image_of(image, manifest, rasters));
    rasters += image.png_size();
  }
  return out;
}

BatterySettings battery_of(const proto::Battery& battery) {
  BatterySettings out;
  out.capacity_mAh = battery.capacity_mah();
  out.charge = battery.charge();
  out.charge_sd = battery.charge_sd();
  out.idle_mA = battery.idle_ma();
  out.sleep_mA = battery.sleep_ma();
  out.motor_mA = battery.motor_ma();
  out.led_mA = battery.led_ma();
  out.transmission_mA = battery.transmission_ma();
  out.resistance_ohm = battery.resistance_ohm();
  out.reading_sd = battery.reading_sd();
  for (const proto::Charger& charger : battery.charger())
    out.chargers.push_back({charger.x_mm(), charger.y_mm(), charger.radius_mm(), charger.current_ma()});
  return out;
}

ArenaFieldSettings field_of(const proto::ArenaField& field) {
  ArenaFieldSettings out{field.name(), {}, field.cell_mm(), field.forget_s(), {}, {}};
  switch (field.counts()) {
    case proto::ArenaField::DRIVEN_TIME: out.counts = ArenaFieldSettings::Counts::kDrivenTime; break;
    case proto::ArenaField::PRESENT_TIME: out.counts = ArenaFieldSettings::Counts::kPresentTime; break;
    case proto::ArenaField::VISITS: out.counts = ArenaFieldSettings::Counts::kVisits; break;
    case proto::ArenaField::TRAIL: out.counts = ArenaFieldSettings::Counts::kTrail; break;
  }
  if (field.has_corner_x_mm()) out.corner_x_mm = field.corner_x_mm();
  if (field.has_corner_y_mm()) out.corner_y_mm = field.corner_y_mm();
  return out;
}

decltype(FunctionSettings::shape) shape_of(const proto::Function& f) {
  switch (f.shape_case()) {
    case proto::Function::kConstant: return ConstantShape{f.constant()};
    case proto::Function::kLinear: return LinearShape{f.linear().at_zero(), f.linear().slope()};
    case proto::Function::kExponential:
      return ExponentialShape{f.exponential().at_zero(), f.exponential().at_infinity(), f.exponential().scale()};
    case proto::Function::kHarmonic:
      return HarmonicShape{f.harmonic().mean(), f.harmonic().cosine(), f.harmonic().sine(), f.harmonic().period()};
    case proto::Function::kSpline: return SplineShape{list(f.spline().knot()), list(f.spline().value())};
    case proto::Function::kSpline2D:
      return Spline2dShape{list(f.spline_2d().knot()), list(f.spline_2d().and_knot()), list(f.spline_2d().value())};
    case proto::Function::kSteps: return StepsShape{list(f.steps().at()), list(f.steps().value())};
    case proto::Function::kTable:
      return TableShape{list(f.table().key()), list(f.table().value()), f.table().otherwise()};
    case proto::Function::kNoise: return NoiseShape{f.noise().sd(), f.noise().correlation_s()};
    case proto::Function::kEpisodes:
      return EpisodesShape{f.episodes().mean_apart_s(), f.episodes().scale_s(), f.episodes().tail(),
                           f.episodes().longest_s(), f.episodes().shape()};
    case proto::Function::SHAPE_NOT_SET: break;
  }
  return ConstantShape{0};
}

// These enumerations have the numbers of the schema; tests/core/plan compares them name by name.
Covariate covariate_of(proto::Function::Covariate covariate) { return static_cast<Covariate>(covariate); }
EffectSettings::Target target_of(proto::Effect::Target target) {
  return static_cast<EffectSettings::Target>(target);
}

}  // namespace

FunctionSettings settings_of(const proto::Function& function) {
  FunctionSettings out;
  out.of = covariate_of(function.of());
  out.and_of = covariate_of(function.and_of());
  out.radius_mm = function.radius_mm();
  out.field = function.field();
  out.forget_s = function.forget_s();
  out.focus = function.focus();
  out.toward_deg = function.toward_deg();
  out.along_deg = function.along_deg();
  out.others = static_cast<Others>(function.others());
  out.other_robots = {function.other_robot().begin(), function.other_robot().end()};
  std::sort(out.other_robots.begin(), out.other_robots.end());
  const proto::MovingPoint& point = function.point();
  out.point = {point.x_mm(), point.y_mm(), point.velocity_x_mm_s(), point.velocity_y_mm_s(), point.growth_mm_s()};
  out.shape = shape_of(function);
  return out;
}

EffectSettings settings_of(const proto::Effect& effect) {
  EffectSettings out;
  out.target = target_of(effect.acts_on());
  switch (effect.wheel()) {
    case proto::Effect::BOTH_WHEELS: out.wheel = EffectSettings::Wheel::kBoth; break;
    case proto::Effect::LEFT_WHEEL: out.wheel = EffectSettings::Wheel::kLeftWheel; break;
    case proto::Effect::RIGHT_WHEEL: out.wheel = EffectSettings::Wheel::kRightWheel; break;
  }
  out.direction_deg = effect.direction_deg();
  out.functions = each<FunctionSettings>(effect.function(), settings_of);
  for (const int command : effect.during()) out.during.push_back(static_cast<MotionCommand>(command));
  out.robots = list(effect.robot());
  out.sum = effect.sum();
  return out;
}

LightSourceSettings settings_of(const proto::LightSource& source) {
  LightSourceSettings out;
  out.x_mm = source.x_mm();
  out.y_mm = source.y_mm();
  out.height_mm = source.height_mm();
  out.intensity = source.intensity();
  out.loop = source.loop();
  out.on = source.on();
  out.switch_period_s = source.switch_period_s();
  if (source.has_circle()) {
    const proto::LightCircle& circle = source.circle();
    out.circle = {circle.radius_mm(), circle.period_s(), circle.phase_deg(), circle.clockwise()};
  }
  out.waypoints = each(source.waypoint(), waypoint_of);
  out.switch_s = list(source.switch_s());
  return out;
}

EnvironmentSettings settings_of(const proto::VirtualEnvironment& environment) {
  EnvironmentSettings out;
  if (environment.has_bits()) out.bits = {environment.bits().first(), environment.bits().count()};
  if (environment.has_hub()) {
    out.built_in = "hub";
    out.parameters = parameters_of(environment.hub());
  } else if (environment.has_foraging()) {
    out.built_in = "foraging";
    out.parameters = parameters_of(environment.foraging());
  } else if (environment.has_plugin()) {
    const proto::StationPlugin& plugin = environment.plugin();
    out.built_in = plugin.built_in();
    if (plugin.source_size() > 0) out.name = plugin.source(0);
    for (const proto::PluginParameter& parameter : plugin.parameter())
      out.parameters[parameter.name()] = parameter.value();
    out.ends_run = plugin.on_failure() == proto::StationPlugin::END_RUN;
  }
  if (out.name.empty()) out.name = out.built_in;
  return out;
}

Program settings_of(const proto::Program& program) {
  return {program.path(), program.sha256(), program.firmware()};
}

void check_manifest(const proto::Manifest& manifest) {
  require(manifest.format() == kManifestFormat, "is of format " + std::to_string(manifest.format()),
          "this program reads format 1: prepare the run again");
  const proto::Experiment& experiment = manifest.experiment();
  const proto::Deployment& deployment = experiment.deployment();
  require(experiment.tick_cycles() > 0, "tick_cycles is 0", "2^15..2^20");
  require(experiment.duration_s() > 0 && experiment.duration_s() <= 1e6, "duration_s is out of range",
          "above 0, at most 1e6");
  require(experiment.arena().width_mm() > 0 && experiment.arena().height_mm() > 0, "the arena is empty",
          "40..1e6 mm");
  const auto divides = [](std::uint32_t n) { return n >= 1 && n <= 64; };
  require(divides(deployment.partition_columns()) && divides(deployment.partition_rows()) &&
              divides(deployment.hosts()),
          "partition_columns, partition_rows or hosts is out of range", "1..64 each");

  std::uint64_t robots = 0;
  for (const proto::RobotGroup& group : experiment.robots()) robots += group.count();
  const auto poses = static_cast<std::uint64_t>(manifest.x_mm_size());
  require(poses == robots && manifest.y_mm_size() == manifest.x_mm_size() &&
              manifest.heading_rad_size() == manifest.x_mm_size(),
          "the initial poses do not match the " + std::to_string(robots) + " robots of the experiment",
          "one pose per robot");
  require(manifest.group_program_size() == experiment.robots_size(),
          "group_program does not match the groups of robots", "one entry per group");
  for (const std::uint32_t program : manifest.group_program()) {
    require(
        program == kNoProgram || program < static_cast<std::uint32_t>(manifest.program_size()),
        "group_program names program " + std::to_string(program) + " of " + std::to_string(manifest.program_size()),
        "an index into program");
  }
  int rasters = 0;
  for (const proto::LightImage& image : experiment.light().image()) rasters += image.png_size();
  require(manifest.light_raster_size() == rasters, "the pictures of light do not match the experiment",
          "one raster per picture");
  for (const proto::LightRaster& raster : manifest.light_raster()) {
    const std::uint64_t pixels = std::uint64_t{raster.columns()} * raster.rows();
    require(pixels > 0 && raster.brightness().size() == pixels, "a picture of light is damaged",
            "as many octets as pixels");
  }
  const int plugins = manifest.station_plugin_size();
  require(plugins == 0 || plugins == experiment.station().environment_size(),
          "station_plugin does not match the virtual environments", "one entry per environment");
  for (const proto::RobotEeprom& eeprom : manifest.eeprom()) {
    require(eeprom.robot() < robots && eeprom.content().size() == 1024, "an EEPROM is damaged", "1024 octets");
  }
}

PlanSettings settings_of(const proto::Manifest& manifest) {
  const proto::Experiment& experiment = manifest.experiment();
  PlanSettings out;
  out.name = experiment.name();
  out.run_number = experiment.run_number();
  out.motion = motion_of(experiment.motion());
  out.robots = each(experiment.robot_model(), robot_of);
  out.effects = each<EffectSettings>(experiment.effect(), settings_of);
  out.fields = each(experiment.field(), field_of);
  out.physics = physics_of(experiment.physics());
  out.radio = radio_of(experiment.radio());
  out.station = station_of(manifest);
  out.tracking = tracking_of(experiment);
  if (experiment.has_light()) out.light = light_of(experiment.light(), manifest);
  if (experiment.has_battery()) out.battery = battery_of(experiment.battery());
  if (experiment.has_temperature()) {
    const proto::Temperature& temperature = experiment.temperature();
    out.temperature = {temperature.celsius(), temperature.offset_sd(), temperature.reading_sd()};
  }
  out.recording = {experiment.recording().every_s(), experiment.recording().messages()};
  out.programs = each<Program>(manifest.program(), settings_of);
  for (const proto::RobotEeprom& eeprom : manifest.eeprom())
    out.eeproms.push_back({eeprom.robot(), eeprom.content()});
  for (const proto::ProgramFailure& failure : manifest.program_failure())
    out.program_failures.push_back({failure.robot(), Tick{failure.tick()}});
  out.poses.reserve(static_cast<std::size_t>(manifest.x_mm_size()));
  for (int i = 0; i < manifest.x_mm_size(); ++i)
    out.poses.push_back({manifest.x_mm(i), manifest.y_mm(i), manifest.heading_rad(i)});
  return out;
}

}  // namespace kilotwin
