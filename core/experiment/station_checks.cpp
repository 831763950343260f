// The base station: what the table of ranges cannot say.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "core/base/say.hpp"
#include "core/experiment/field_checks.hpp"
#include "core/experiment/fields.hpp"

namespace kilotwin {
namespace {

constexpr double kShortestPacketInterval_s = 0.05;
constexpr std::uint32_t kBits = 14;  // type and data of a message
constexpr std::array<std::string_view, 5> kBuiltIn{"hub", "foraging", "identify", "assign_ids", "calibrate"};

std::string path_of(int environment) { return fmt::format("station.environment[{}]", environment); }

void check_plugin(const LoadedExperiment& loaded, const proto::StationPlugin& plugin, const std::string& path) {
  if ((plugin.source_size() > 0) == plugin.has_built_in()) {
    throw loaded.locations.error(path, "plugin takes either source: \"FILE.cpp\" or built_in: \"NAME\"");
  }
  if (plugin.has_built_in() && std::find(kBuiltIn.begin(), kBuiltIn.end(), plugin.built_in()) == kBuiltIn.end()) {
    throw loaded.locations.error(
        path + ".built_in",
        fmt::format("built_in is \"{}\"; it takes {}", one_line(plugin.built_in(), 60), fmt::join(kBuiltIn, ", ")));
  }
  std::set<std::string> names;
  for (int i = 0; i < plugin.parameter_size(); ++i) {
    const proto::PluginParameter& parameter = plugin.parameter(i);
    const std::string place = fmt::format("{}.parameter[{}]", path, i);
    if (!parameter.has_name() || !parameter.has_value())
      throw loaded.locations.error(place, "a parameter takes a name and a value");
    if (!names.insert(parameter.name()).second)
      throw loaded.locations.error(
          place, fmt::format("parameter \"{}\" is given twice; keep one of them", one_line(parameter.name(), 60)));
  }
}

void check_bits(const LoadedExperiment& loaded) {
  const proto::Station& station = loaded.experiment.station();
  std::uint32_t taken = 0;
  for (int i = 0; i < station.environment_size(); ++i) {
    if (station.environment(i).has_bits() != station.environment(0).has_bits()) {
      throw loaded.locations.error(path_of(i),
                                   "bits are given for some environments only; give them for all, or none");
    }
    if (!station.environment(i).has_bits()) continue;
    const proto::BitField& bits = station.environment(i).bits();
    const std::string path = path_of(i) + ".bits";
    if (bits.first() + bits.count() > kBits) {
      throw loaded.locations.error(path, fmt::format("bits {}..{} do not exist; a message has the bits 0..13",
                                                     bits.first(), bits.first() + bits.count() - 1));
    }
    const std::uint32_t own = ((1u << bits.count()) - 1) << bits.first();
    if ((own & taken) != 0)
      throw loaded.locations.error(path, "the bits overlap those of an environment above; each bit has one owner");
    taken |= own;
  }
}

}  // namespace

void check_station(const LoadedExperiment& loaded) {
  const proto::Station& station = loaded.experiment.station();
  if (station.packet_interval_s() > 0 && station.packet_interval_s() < kShortestPacketInterval_s) {
    throw loaded.locations.error("station.packet_interval_s",
                                 fmt::format("packet_interval_s is {}; it takes 0, or at least 0.05 s",
                                             number_text(station.packet_interval_s())));
  }
  for (int i = 0; i < station.environment_size(); ++i) {
    const proto::VirtualEnvironment& environment = station.environment(i);
    if (environment.kind_case() == proto::VirtualEnvironment::KIND_NOT_SET) {
      throw loaded.locations.error(path_of(i), "environment has no kind; it takes hub, foraging or plugin { ... }");
    }
    if (environment.has_plugin()) check_plugin(loaded, environment.plugin(), path_of(i) + ".plugin");
  }
  check_bits(loaded);
}

void check_station_files(const LoadedExperiment& loaded) {
  const proto::Station& station = loaded.experiment.station();
  for (int i = 0; i < station.environment_size(); ++i) {
    const proto::StationPlugin& plugin = station.environment(i).plugin();
    for (int k = 0; k < plugin.source_size(); ++k) {
      std::error_code ignored;
      if (std::filesystem::is_regular_file(loaded.resolve(plugin.source(k)), ignored)) continue;
      throw loaded.locations.error(
          fmt::format("{}.plugin.source[{}]", path_of(i), k),
          fmt::format("there is no file {}; name a C++ file of the plugin, relative to the experiment file",
                      one_line(loaded.resolve(plugin.source(k)).string())));
    }
  }
}

}  // namespace kilotwin
