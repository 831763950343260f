#include "clients/view/work.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "clients/recorder/summary.hpp"

namespace kilotwin::view {
namespace {

using nlohmann::json;

json federates_of(const std::vector<FederateTime>& federates) {
  json list = json::array();
  for (const FederateTime& one : federates)
    list.push_back({{"name", one.name}, {"step", one.step_s}, {"exchange", one.exchange_s}, {"wait", one.wait_s}});
  return list;
}

}  // namespace

std::string work_text(bool live, const std::vector<FederateTime>& federates) {
  return json{{"type", "work"}, {"live", live}, {"federates", federates_of(federates)}, {"cost", json::array()}}
      .dump();
}

std::string work_text(const recorder::Summary& summary) {
  json cost = json::array();
  const recorder::Summary::Cost& c = summary.cost_ns_per_robot_tick;
  const std::array<std::pair<const char*, double>, 6> subjects{{{"behaviours", c.behaviours},
                                                                {"physics", c.physics},
                                                                {"radio", c.radio},
                                                                {"station", c.station},
                                                                {"exchange", c.exchange},
                                                                {"recording", c.recording}}};
  for (const auto& [name, ns] : subjects)
    if (ns > 0) cost.push_back({{"name", name}, {"ns", ns}});
  return json{{"type", "work"},
              {"live", false},
              {"federates", federates_of(summary.federates)},
              {"cost", cost},
              {"sent", summary.messages.sent},
              {"received", summary.messages.received},
              {"simulatedSeconds", summary.simulated_s},
              {"meanSpeed", summary.realtime_factor()}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

void LiveWork::take(const WireMetrics& metrics, Clock::time_point now) {
  std::deque<Report>& reports = reports_[metrics.publisher];
  // A federate that was started again counts from 0.
  if (!reports.empty() && reports.back().step_ns > metrics.step_ns) reports.clear();
  reports.push_back({now, metrics.step_ns, metrics.exchange_ns, metrics.wait_ns});
  while (reports.size() > 2 && now - reports[1].when > kWindow) reports.pop_front();
}

std::vector<FederateTime> LiveWork::recent(const RunPlan& plan) const {
  std::vector<FederateTime> federates;
  for (const auto& [federate, reports] : reports_) {
    if (federate >= plan.federates() || reports.size() < 2) continue;
    const Report &from = reports.front(), &to = reports.back();
    const auto seconds = [](std::uint64_t a, std::uint64_t b) { return static_cast<double>(b - a) * 1e-9; };
    federates.push_back({plan.name(FederateId{federate}), seconds(from.step_ns, to.step_ns),
                         seconds(from.exchange_ns, to.exchange_ns), seconds(from.wait_ns, to.wait_ns)});
  }
  return federates;
}

}  // namespace kilotwin::view
