/// All settings of a run, by subject. Only core/plan includes this header. Other units get each subject from RunPlan and include
/// only its header.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/pose.hpp"
#include "core/plan/effect_settings.hpp"
#include "core/plan/motion_settings.hpp"
#include "core/plan/physics_settings.hpp"
#include "core/plan/radio_settings.hpp"
#include "core/plan/run_settings.hpp"
#include "core/plan/senses_settings.hpp"
#include "core/plan/station_settings.hpp"
#include "core/plan/tracking_settings.hpp"

namespace kilotwin {

struct PlanSettings {
  std::string name;
  std::uint32_t run_number = 0;
  MotionSettings motion;
  std::vector<RobotSettings> robots;
  std::vector<EffectSettings> effects;
  std::vector<ArenaFieldSettings> fields;
  PhysicsSettings physics;
  RadioSettings radio;
  StationSettings station;
  TrackingSettings tracking;
  std::optional<LightSettings> light;
  std::optional<BatterySettings> battery;
  std::optional<TemperatureSettings> temperature;
  RecordingSettings recording;
  std::vector<Program> programs;
  std::vector<RobotEeprom> eeproms;
  std::vector<ProgramFailure> program_failures;
  std::vector<Pose> poses;  ///< per robot, at tick 0
};

}  // namespace kilotwin
