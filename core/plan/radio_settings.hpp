/// Settings of the infrared channel. Radio and SimpleRadio in idl/experiment.proto and the other messages in idl/model.proto give
/// meaning, units and defaults.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace kilotwin {

/// An absent value is drawn at random.
struct RobotRadioSettings {
  std::uint32_t robot = 0;
  std::optional<double> power_db, sensitivity_db;
  std::optional<double> power_ahead_db, power_left_db, sensitivity_ahead_db, sensitivity_left_db;
  std::optional<double> oscillator;
  std::vector<std::uint32_t> ir_high, ir_low;  ///< both have 14 readings, or both are empty
};

struct RadioLinkSettings {
  std::uint32_t sender = 0, receiver = 0;
  double offset_db = 0;
};

struct PropagationSettings {
  double decay_db_per_mm = 0;
  double power_sd_db = 0, sensitivity_sd_db = 0;
  double power_bearing_sd_db = 0, sensitivity_bearing_sd_db = 0;
  double body_loss_db = 0;
  double link_sd_db = 0, pair_sd_db = 0, run_sd_db = 0, packet_sd_db = 0;
  double capture_db = 0;
  double reading_sd_db = 0, calibration_sd_db = 0;
  double notice_db = 0;
  std::vector<double> power_pattern_db, sensitivity_pattern_db;  ///< a1 b1 a2 b2..
  std::vector<RobotRadioSettings> robots;
  std::vector<RadioLinkSettings> links;
};

/// The model of the ARGoS paper (Pinciroli 2018, section 2.3).
struct SimpleRadioSettings {
  double interval_s = 0;
  double sending_error = 0, drop_probability = 0, contention = 0;
};

struct RadioSettings {
  enum class Model : std::uint8_t { kPropagation, kDisc, kSimple };
  Model model = Model::kDisc;
  double range_mm = 0;
  double oscillator_sd = 0;
  double loss = 0;
  PropagationSettings propagation;
  SimpleRadioSettings simple;
};

}  // namespace kilotwin
