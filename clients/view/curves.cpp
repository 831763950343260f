#include "clients/view/curves.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace kilotwin::view {
namespace {

std::string numbers(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) {
    if (text.size() > 1) text += ',';
    text += std::isfinite(value) ? fmt::format("{:.6g}", value) : "null";
  }
  return text + ']';
}

}  // namespace

std::string plots_text(const std::vector<PlotEntry>& plots) {
  nlohmann::json list = nlohmann::json::array();
  for (const PlotEntry& plot : plots) {
    list.push_back({{"name", plot.name},
                    {"title", plot.title},
                    {"unit", plot.unit},
                    {"swarm", plot.of_swarm},
                    {"robot", plot.of_robot},
                    {"variable", plot.is_variable},
                    {"absent", plot.absent}});
  }
  return nlohmann::json{{"type", "plots"}, {"plots", list}}.dump(-1, ' ', false,
                                                                 nlohmann::json::error_handler_t::replace);
}

std::string plot_text(std::uint32_t number, std::optional<std::uint32_t> robot, const Curves& curves) {
  std::string text =
      fmt::format("{{\"type\":\"plot\",\"plot\":{},\"robot\":{},\"whole\":{},\"names\":{},\"time\":{},\"values\":[",
                  number, robot ? std::to_string(*robot) : "null", curves.whole,
                  nlohmann::json(curves.names).dump(), numbers(curves.time_s));
  for (std::size_t i = 0; i < curves.values.size(); ++i) text += (i > 0 ? "," : "") + numbers(curves.values[i]);
  return text + "]}";
}

}  // namespace kilotwin::view
