/// Where a plugin runs: plugins with sources in a process of their own, so that a crash or an endless loop costs the plugin
/// alone; built-in ones in this process, by the same Runner.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/plan/station_settings.hpp"
#include "services/ark/plugin/wire.hpp"

namespace kilotwin::ark {

class PluginHost {
 public:
  virtual ~PluginHost() = default;
  /// The plugin's reply. After a reply with a `failure` that says `crashed` every further one fails, too.
  [[nodiscard]] virtual station::Reply ask(const station::Request& request) = 0;
};

/// The time that a call of a plugin may take: processor time of its process, and wall time for one that waits for ever. Calls
/// of a step have a wall time of their own: in a run at a pace, real robots drive on meanwhile.
struct PluginPatience {
  double cpu_s = 2, wall_s = 60, step_wall_s = 60;
  static constexpr double kPacedStep_s = 2;  ///< step_wall_s of a run at a pace
  /// Called some 20 times a second while the station waits for a plugin in a process of its own.
  std::function<void()> while_waiting{};
};

/// Throws UserError where the run directory lacks the plugin's object, or there is no built-in plugin of the name.
[[nodiscard]] std::unique_ptr<PluginHost> make_plugin_host(const EnvironmentSettings&,
                                                           const std::string& host_sha256,
                                                           const std::filesystem::path& run_directory,
                                                           PluginPatience = {});
/// `program`: the host's executable; `object`: the plugin's shared object. Throws RunError where it cannot be started.
[[nodiscard]] std::unique_ptr<PluginHost> start_plugin_process(const std::filesystem::path& program,
                                                               const std::filesystem::path& object,
                                                               PluginPatience = {});

}  // namespace kilotwin::ark
