#include "core/observations/variable_sampler.hpp"

#include "core/plan/senses_settings.hpp"
#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin {
VariableSampler::VariableSampler(const RunPlan& plan, Share share, bool firmware) {
  const proto::Manifest& manifest = plan.manifest();
  for (int v = 0; v < manifest.variable_size(); ++v) {
    const proto::ProgramVariable& from = manifest.variable(v);
    Variable variable{static_cast<std::uint32_t>(v),
                      from.integer(),
                      RecordingSchedule(plan.tick_length, from.every_s()),
                      {},
                      {},
                      {}};
    const bool battery = from.name() == kBatteryVariable && plan.battery_settings().has_value();
    for (const proto::VariablePlace& place : from.place()) variable.places.emplace_back(place);
    for (std::uint32_t robot = share.first; robot < share.last; ++robot) {
      const std::uint32_t program = plan.program_of(robot);
      if (program == kNoProgram || plan.firmware(robot) != firmware) continue;
      if (battery && !plan.tracked(robot)) variable.batteries.push_back(robot);
      for (int p = 0; p < from.place_size(); ++p) {
        if (from.place(p).program() == program) variable.readings.push_back({robot, static_cast<std::uint32_t>(p)});
      }
    }
    if (!variable.readings.empty() || !variable.batteries.empty()) variables_.push_back(std::move(variable));
  }
}

void VariableSampler::sample(Tick now, const ProgramMemory& memory,
                             const std::function<double(std::uint32_t robot)>& battery_V,
                             proto::Observations& to) const {
  for (const Variable& variable : variables_) {
    if (!variable.schedule.due(now)) continue;
    proto::VariableRecord& record = *to.add_variable();
    record.set_tick(now.count());
    record.set_variable(variable.index);
    for (const Reading& reading : variable.readings) {
      const VariablePlace& place = variable.places[reading.place];
      const std::optional<std::uint64_t> raw = place.fetch(reading.robot, memory);
      if (!raw) continue;
      record.add_robot(reading.robot);
      if (variable.integer)
        record.add_integer(place.whole(*raw));
      else
        record.add_number(place.number(*raw));
    }
    for (const std::uint32_t robot : variable.batteries) {
      record.add_robot(robot);
      record.add_number(battery_V(robot));
    }
    if (record.robot_size() == 0) to.mutable_variable()->RemoveLast();
  }
}

}  // namespace kilotwin
