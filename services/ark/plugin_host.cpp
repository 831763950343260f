#include "services/ark/plugin_host.hpp"

#include <array>
#include <utility>

#include "core/base/error.hpp"
#include "services/ark/plugin/runner.hpp"

// createExpt() of each built-in plugin, under a name of its own: CMakeLists.txt.
extern "C" {
kilotwin::station::KilobotExperiment* kilotwin_plugin_assign_ids();
kilotwin::station::KilobotExperiment* kilotwin_plugin_calibrate();
kilotwin::station::KilobotExperiment* kilotwin_plugin_foraging();
kilotwin::station::KilobotExperiment* kilotwin_plugin_hub();
kilotwin::station::KilobotExperiment* kilotwin_plugin_identify();
}

namespace kilotwin::ark {
namespace {

class BuiltIn final : public PluginHost {
 public:
  explicit BuiltIn(station::KilobotExperiment* experiment)
      : runner_(std::unique_ptr<station::KilobotExperiment>(experiment)) {}
  [[nodiscard]] station::Reply ask(const station::Request& request) override { return runner_.answer(request); }

 private:
  station::Runner runner_;
};

}  // namespace

std::unique_ptr<PluginHost> make_plugin_host(const EnvironmentSettings& setting, const std::string& host_sha256,
                                             const std::filesystem::path& run_directory, PluginPatience patience) {
  using Create = station::KilobotExperiment* (*)();
  constexpr std::array<std::pair<const char*, Create>, 5> kBuiltIn{{{"assign_ids", kilotwin_plugin_assign_ids},
                                                                    {"calibrate", kilotwin_plugin_calibrate},
                                                                    {"foraging", kilotwin_plugin_foraging},
                                                                    {"hub", kilotwin_plugin_hub},
                                                                    {"identify", kilotwin_plugin_identify}}};
  for (const auto& [name, create] : kBuiltIn) {
    if (setting.built_in == name) return std::make_unique<BuiltIn>(create());
  }
  if (!setting.built_in.empty())
    throw UserError("station.environment: there is no built-in plugin \"" + setting.built_in + "\"");
  if (setting.sha256.empty())
    throw UserError("station.environment: no kind of environment; give hub, foraging or plugin { ... }");
  const std::filesystem::path folder = run_directory / "plugins";
  const std::filesystem::path program = folder / host_sha256, object = folder / (setting.sha256 + ".so");
  for (const std::filesystem::path& file : {program, object}) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
      throw UserError(file.string() + ": cannot be read; the run directory must hold the plugins of its manifest");
  }
  return start_plugin_process(program, object, std::move(patience));
}

}  // namespace kilotwin::ark
