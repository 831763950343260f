#include "clients/monitor/report.hpp"

#include <nlohmann/json.hpp>

namespace kilotwin::monitor {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Alarm& alarm) {
  Json sizes = Json::array();
  for (const Size& size : alarm.sizes)
    sizes.push_back(Json{{"value", size.value}, {"standard_error", size.standard_error}});
  Json alternatives = Json::array();
  for (const Suspect suspect : alarm.alternatives) alternatives.push_back(word_of(suspect));
  return Json{{"time_s", alarm.time_s},
              {"onset_s", alarm.onset_s},
              {"suspect", word_of(alarm.suspect)},
              {"alternatives", alternatives},
              {"robots", alarm.robots},
              {"tracker", alarm.tracker},
              {"x_mm", alarm.x_mm},
              {"y_mm", alarm.y_mm},
              {"unit", unit_of(alarm.suspect)},
              {"sizes", sizes},
              {"evidence_nat", alarm.evidence_nat},
              {"threshold_nat", alarm.threshold_nat}};
}

Json axes(const std::array<double, 3>& values) {
  return Json{{"along", values[0]}, {"across", values[1]}, {"heading", values[2]}};
}

}  // namespace

std::string report_json(const MonitorSettings& settings, const Totals& totals, std::span<const Alarm> alarms) {
  Json all = Json::array();
  for (const Alarm& alarm : alarms) all.push_back(json_of(alarm));
  const auto dispersion = [&](Group group) { return totals.dispersion[static_cast<std::size_t>(group)]; };
  return Json{{"false_alarms_per_hour", settings.false_alarms_per_hour},
              {"warm_up_s", settings.warm_up_s},
              {"threshold_nat", Json{{"lasting", totals.threshold_nat}, {"shifts", totals.shift_threshold_nat}}},
              {"robots_tracked", totals.robots_tracked},
              {"robots_watched", totals.robots_watched},
              {"tested_robot_hours", totals.tested_robot_hours},
              {"measurements", totals.samples},
              {"outliers", totals.outliers},
              {"innovation_mean", axes(totals.white_mean)},
              {"innovation_variance", axes(totals.white_variance)},
              {"dispersion", Json{{"gain", dispersion(Group::kGain)},
                                  {"bias", dispersion(Group::kBias)},
                                  {"heading", dispersion(Group::kHeading)},
                                  {"drift", dispersion(Group::kDrift)},
                                  {"shift", dispersion(Group::kShift)}}},
              {"alarms", all}}
      .dump();
}

}  // namespace kilotwin::monitor
