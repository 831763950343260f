#include "core/model/radio_parameters.hpp"

#include <algorithm>

#include "core/model/ranging.hpp"
#include "core/plan/radio_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin {

RadioParameters::RadioParameters(const RunPlan& plan)
    : decay_db_per_mm_(plan.radio_settings().propagation.decay_db_per_mm),
      power_db_(plan.robots(), 0),
      sensitivity_db_(plan.robots(), 0),
      calibration_db_(plan.robots(), 0),
      power_bearing_(plan.robots()),
      sensitivity_bearing_(plan.robots()) {
  if (plan.radio_settings().model != RadioSettings::Model::kPropagation) return;
  const PropagationSettings& model = plan.radio_settings().propagation;
  const Random random(plan.seed());
  for (std::uint32_t i = 0; i < plan.robots(); ++i) {
    const auto draw = [&](std::uint32_t number, double sd) {
      return sd > 0 ? sd * random.normal(Stream::kLink, i, Tick{-1}, number) : 0.0;
    };
    power_db_[i] = draw(0, model.power_sd_db);
    sensitivity_db_[i] = draw(1, model.sensitivity_sd_db);
    power_bearing_[i] = {draw(2, model.power_bearing_sd_db), draw(3, model.power_bearing_sd_db)};
    sensitivity_bearing_[i] = {draw(4, model.sensitivity_bearing_sd_db), draw(5, model.sensitivity_bearing_sd_db)};
    calibration_db_[i] = draw(6, model.calibration_sd_db);
  }
  for (const RobotRadioSettings& known : model.robots) {
    const std::uint32_t i = known.robot;
    if (i >= plan.robots()) continue;
    if (known.power_db) power_db_[i] = *known.power_db;
    if (known.sensitivity_db) sensitivity_db_[i] = *known.sensitivity_db;
    if (known.power_ahead_db) power_bearing_[i].ahead_db = *known.power_ahead_db;
    if (known.power_left_db) power_bearing_[i].left_db = *known.power_left_db;
    if (known.sensitivity_ahead_db) sensitivity_bearing_[i].ahead_db = *known.sensitivity_ahead_db;
    if (known.sensitivity_left_db) sensitivity_bearing_[i].left_db = *known.sensitivity_left_db;
    if (known.ir_high.size() != KILOTWIN_IR_ENTRIES) continue;
    RangingTable& table = stated_.emplace_back(i, RangingTable{}).second;
    for (std::size_t n = 0; n < KILOTWIN_IR_ENTRIES; ++n) {
      table.high[n] = static_cast<std::uint16_t>(known.ir_high[n]);
      table.low[n] = static_cast<std::uint16_t>(known.ir_low[n]);
    }
  }
  const auto nonzero = [](double db) { return db != 0; };
  own_tables_ = !stated_.empty() || std::any_of(sensitivity_db_.begin(), sensitivity_db_.end(), nonzero) ||
                std::any_of(calibration_db_.begin(), calibration_db_.end(), nonzero);
}

RangingTable RadioParameters::table(std::uint32_t robot) const {
  for (const auto& [id, table] : stated_) {
    if (id == robot) return table;
  }
  const Ranging ranging;
  const double nearer_mm = (sensitivity_db_[robot] + calibration_db_[robot]) / decay_db_per_mm_;
  RangingTable table;
  for (std::size_t n = 0; n < table.high.size(); ++n) {
    const double distance_mm = KILOTWIN_IR_CONTACT_MM + KILOTWIN_IR_STEP_MM * static_cast<double>(n);
    const Gains gains = ranging.gains(distance_mm - nearer_mm);
    table.high[n] = static_cast<std::uint16_t>(gains.high);
    table.low[n] = static_cast<std::uint16_t>(gains.low);
  }
  return table;
}

}  // namespace kilotwin
