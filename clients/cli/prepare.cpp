#include "clients/cli/prepare.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <random>
#include <set>

#include "clients/cli/page_recording.hpp"
#include "clients/cli/recorded_variables.hpp"
#include "clients/recorder/provenance.hpp"
#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/dds/dds.hpp"
#include "core/experiment/field_checks.hpp"
#include "core/experiment/layout.hpp"
#include "core/experiment/limits.hpp"
#include "core/experiment/radio_population.hpp"
#include "core/experiment/surroundings.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/os/files.hpp"
#include "core/os/limits.hpp"
#include "core/plan/from_manifest.hpp"
#include "core/plan/plan.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/robot_warnings.hpp"
#include "services/behaviours/sha256.hpp"
#include "services/comm/firmware/flash_image.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

/// Limits of simulated time over wall time. At the slowest pace a tick takes minutes.
constexpr double kSlowestPace = 1e-4, kFastestPace = 1e9;
/// Limit of a robot's coordinates. Arenas are at most 1e6 mm wide.
constexpr double kFarthest_mm = 1e7;

double parse_pace(const std::string& text) {
  if (text == "max") return 0;
  double factor = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), factor);
  if (error != std::errc() || end != text.data() + text.size() || !(factor >= kSlowestPace) ||
      !(factor <= kFastestPace)) {
    throw UserError(
        fmt::format("--pace: \"{}\" is no pace; give max, or a factor from {:g} to {:g} such as 1 for real time",
                    text, kSlowestPace, kFastestPace));
  }
  return factor;
}

/// A random run id. Ids of runs on one domain must differ; results do not depend on them.
std::uint64_t new_run_id() {
  std::random_device device;
  const std::uint64_t id = static_cast<std::uint64_t>(device()) << 32 | device();
  return id != 0 ? id : 1;
}

/// Reads and checks firmware, which runs unchanged. Throws UserError if the file is not firmware.
behaviours::CompiledProgram checked_firmware(const fs::path& file) {
  const auto octets = os::read_if_there(file);
  if (!octets) throw UserError(file.string() + ": cannot be read; give an .elf or .hex file");
  static_cast<void>(firmware::parse_firmware(*octets, file.string()));
  return {file, behaviours::sha256_hex(*octets), {}};
}

/// Shows a program's warnings, the first of them if there are many. A program that is given compiled has no sources.
void show_warnings(const behaviours::CompiledProgram& program, const behaviours::CompileOptions& options) {
  constexpr std::size_t kMost = 10;
  if (program.sources.empty()) return;
  const std::vector<std::string> warnings = behaviours::program_warnings(program.sources, program.sha256, options);
  for (std::size_t n = 0; n < std::min(warnings.size(), kMost); ++n) say(warnings[n]);
  if (warnings.size() > kMost) {
    say(fmt::format("{}: {} more warnings; `kilotwin build` shows all", program.sources.front().string(),
                    warnings.size() - kMost));
  }
}

/// Compiles each distinct program once and records each group's program. Returns the compiled files, in the manifest's order.
std::vector<fs::path> build_programs(const LoadedExperiment& loaded, const RunArguments& arguments,
                                     proto::Manifest& manifest, Notes notes) {
  std::vector<fs::path> objects;
  for (const proto::RobotGroup& group : loaded.experiment.robots()) {
    if (group.body() == proto::RobotGroup::TRACKED && !group.says().shadow()) {
      manifest.add_group_program(kNoProgram);
      continue;
    }
    std::vector<fs::path> sources;
    for (const std::string& source : group.behaviour()) sources.push_back(loaded.resolve(source));
    const bool is_linked = firmware::is_firmware(sources.front()), is_firmware = is_linked || group.avr();
    if (is_linked && sources.size() > 1)
      throw UserError(fmt::format("{}: firmware is one file; link its parts first", sources.front().string()));
    if (is_linked && group.says().shadow())
      throw UserError(fmt::format("{}: a shadow runs natively; give C source", sources.front().string()));
    behaviours::CompileOptions options;
    options.defines = arguments.define;
    options.kilolib = arguments.kilolib;
    options.boot_loader = true;
    options.wide_int = group.wide_int();
    const behaviours::CompiledProgram compiled = is_linked     ? checked_firmware(sources.front())
                                                 : group.avr() ? behaviours::compile_firmware(sources, options)
                                                               : behaviours::compile(sources, options);
    if (notes == Notes::kPrinted) {
      for (const std::string& note : compiled.notes) say("note: " + note);
    }
    const bool is_new =
        std::none_of(manifest.program().begin(), manifest.program().end(),
                     [&](const proto::Program& program) { return program.sha256() == compiled.sha256; });
    if (notes == Notes::kPrinted && is_new && !is_firmware) show_warnings(compiled, options);
    int index = 0;
    while (index < manifest.program_size() && manifest.program(index).sha256() != compiled.sha256) ++index;
    if (index == manifest.program_size()) {
      proto::Program& program = *manifest.add_program();
      program.set_path(group.behaviour(0));
      program.set_sha256(compiled.sha256);
      if (is_firmware) program.set_firmware(true);
      objects.push_back(compiled.file);
    }
    manifest.add_group_program(static_cast<std::uint32_t>(index));
  }
  return objects;
}

/// Compiles the station's plugins, and the program that runs them; records both. Returns the compiled files.
std::vector<fs::path> build_plugins(const LoadedExperiment& loaded, const RunArguments& arguments,
                                    proto::Manifest& manifest) {
  std::vector<fs::path> objects;
  behaviours::CompileOptions options;
  options.defines = arguments.define;
  for (const proto::VirtualEnvironment& environment : loaded.experiment.station().environment()) {
    if (environment.plugin().source_size() == 0) {
      manifest.add_station_plugin();
      continue;
    }
    std::vector<fs::path> sources;
    for (const std::string& source : environment.plugin().source()) sources.push_back(loaded.resolve(source));
    const behaviours::CompiledProgram compiled = behaviours::compile_station_plugin(sources, options);
    manifest.add_station_plugin(compiled.sha256);
    objects.push_back(compiled.file);
  }
  if (objects.empty()) return objects;
  const behaviours::CompiledProgram host = behaviours::compile_plugin_host();
  manifest.set_station_host(host.sha256);
  objects.push_back(host.file);
  return objects;
}

/// A name in `folder` that no file has, for a copy of `source`: its own name, or NAME-2 and so on, as for a file of the same name
/// from another folder.
fs::path free_name(const fs::path& folder, const fs::path& source) {
  fs::path name = folder / source.filename();
  for (int number = 2; fs::exists(name); ++number)
    name = folder / fmt::format("{}-{}{}", source.stem().string(), number, source.extension().string());
  return name;
}

/// The plugins as built, and their sources for readers. Throws filesystem_error.
void copy_plugins(const LoadedExperiment& loaded, const proto::Manifest& manifest,
                  const std::vector<fs::path>& objects, const fs::path& to) {
  if (objects.empty()) return;
  fs::create_directories(to);
  std::size_t next = 0;
  std::set<fs::path> copied;
  for (int i = 0; i < manifest.station_plugin_size(); ++i) {
    if (manifest.station_plugin(i).empty()) continue;
    fs::copy_file(objects[next++], to / (manifest.station_plugin(i) + ".so"), fs::copy_options::overwrite_existing);
    for (const std::string& source : loaded.experiment.station().environment(i).plugin().source()) {
      const fs::path from = fs::weakly_canonical(loaded.resolve(source));
      if (from.extension() != ".so" && copied.insert(from).second) fs::copy_file(from, free_name(to, from));
    }
  }
  fs::copy_file(objects[next], to / manifest.station_host(), fs::copy_options::overwrite_existing);
}

/// Copies the source files of the programs, for readers. Throws filesystem_error.
void copy_sources(const LoadedExperiment& loaded, const fs::path& to) {
  std::set<fs::path> copied;
  for (const proto::RobotGroup& group : loaded.experiment.robots()) {
    for (const std::string& name : group.behaviour()) {
      const fs::path source = fs::weakly_canonical(loaded.resolve(name));
      if (copied.insert(source).second) fs::copy_file(source, free_name(to, source));
    }
  }
}

/// The experiment with all overrides and with paths into the run directory, which gets copies of its files, so that it can run again
/// from there. Throws filesystem_error.
std::string experiment_as_run(const LoadedExperiment& loaded, const proto::Manifest& manifest,
                              const recorder::RunDirectory& directory) {
  proto::Experiment experiment = manifest.experiment();
  std::string text;
  for (int g = 0; g < experiment.robots_size(); ++g) {
    proto::RobotGroup& group = *experiment.mutable_robots(g);
    if (group.layout().has_poses()) {
      const std::string copy = fmt::format("poses-{}.csv", g);
      fs::copy_file(loaded.resolve(group.layout().poses().csv()), directory.path() / copy,
                    fs::copy_options::overwrite_existing);
      group.mutable_layout()->mutable_poses()->set_csv(copy);
    }
    if (group.cells().has_configuration()) {
      const std::string copy = fmt::format("cells-{}.kconf", g);
      fs::copy_file(loaded.resolve(group.cells().configuration()), directory.path() / copy,
                    fs::copy_options::overwrite_existing);
      group.mutable_cells()->set_configuration(copy);
    }
    if (group.has_eeprom()) {
      const std::string copy = fmt::format("eeprom-{}", g);
      fs::copy(loaded.resolve(group.eeprom()), directory.path() / copy,
               fs::copy_options::recursive | fs::copy_options::overwrite_existing);
      group.set_eeprom(copy);
    }
    const std::uint32_t program = manifest.group_program(g);
    if (program == kNoProgram) continue;
    text += fmt::format("# robots[{}] run {}\n", g, group.behaviour(0));
    group.clear_behaviour();
    const fs::path object = directory.program(settings_of(manifest.program(static_cast<int>(program))));
    group.add_behaviour(object.lexically_relative(directory.path()).string());
  }
  for (int i = 0; i < manifest.station_plugin_size(); ++i) {
    if (manifest.station_plugin(i).empty()) continue;
    proto::StationPlugin& plugin = *experiment.mutable_station()->mutable_environment(i)->mutable_plugin();
    text += fmt::format("# station.environment[{}] runs {}\n", i, plugin.source(0));
    plugin.clear_source();
    plugin.add_source("plugins/" + manifest.station_plugin(i) + ".so");
  }
  for (int i = 0; i < experiment.light().image_size(); ++i) {
    proto::LightImage& image = *experiment.mutable_light()->mutable_image(i);
    for (int k = 0; k < image.png_size(); ++k) {
      const std::string copy = fmt::format("light-{}-{}.png", i, k);
      fs::copy_file(loaded.resolve(image.png(k)), directory.path() / copy, fs::copy_options::overwrite_existing);
      image.set_png(k, copy);
    }
  }
  std::string fields;
  google::protobuf::TextFormat::PrintToString(experiment, &fields);
  return text + fields;
}

/// Throws UserError or RunError if one machine cannot run that many services.
void check_processes(const proto::Deployment& deployment) {
  const std::uint32_t partitions = deployment.partition_columns() * deployment.partition_rows();
  const std::uint32_t services = partitions + deployment.hosts() + 2;
  if (services > dds::kMostServices) {
    throw UserError(
        fmt::format("--partitions {}x{}: {} services, and one machine has room for {} in a DDS domain; give fewer "
                    "partitions or hosts, use --mode local, or --prepare and start services on several machines",
                    deployment.partition_columns(), deployment.partition_rows(), services, dds::kMostServices));
  }
  constexpr std::uint64_t kOwnFiles = 64;
  require_open_files(kOwnFiles + services, fmt::format("a run of {} services", services));
}

fs::path checkpoint_directory(const fs::path& resume) {
  if (fs::exists(resume / "0000.part")) return resume;
  return newest_checkpoint(recorder::RunDirectory::open(resume, recorder::RunDirectory::Needs::kManifest).path());
}

}  // namespace

std::pair<std::uint32_t, std::uint32_t> parse_partitions(const std::string& text) {
  std::uint32_t columns = 0, rows = 0;
  const char* const last = text.data() + text.size();
  const auto [cross, error] = std::from_chars(text.data(), last, columns);
  if (error == std::errc() && cross != last && *cross == 'x') {
    const auto [end, second_error] = std::from_chars(cross + 1, last, rows);
    if (second_error == std::errc() && end == last) return {columns, rows};
  }
  throw UserError(fmt::format("--partitions: \"{}\" is no grid; give COLUMNSxROWS such as 2x1", text));
}

LoadedExperiment load_with_overrides(const RunArguments& arguments) {
  LoadedExperiment loaded = load_experiment(arguments.experiment);
  if (!arguments.model.empty()) apply_model(loaded, arguments.model);
  for (const std::string& assignment : arguments.set) apply_override(loaded, assignment);
  if (arguments.robots) set_robots(loaded, *arguments.robots);
  if (!arguments.behaviour.empty()) {
    if (!std::filesystem::exists(arguments.behaviour))
      throw UserError(fmt::format("--behaviour {}: there is no such file; a relative path begins where you are",
                                  arguments.behaviour.string()));
    set_behaviour(loaded, arguments.behaviour);
  }
  if (arguments.seed) apply_override(loaded, fmt::format("seed={}", *arguments.seed), "--seed");
  if (arguments.duration_s)
    apply_override(loaded, fmt::format("duration_s={}", *arguments.duration_s), "--duration");
  if (arguments.hosts) apply_override(loaded, fmt::format("deployment.hosts={}", *arguments.hosts), "--hosts");
  if (arguments.checkpoint_every_s) {
    apply_override(loaded, fmt::format("deployment.checkpoint_every_s={}", *arguments.checkpoint_every_s),
                   "--checkpoint-every");
  }
  if (!arguments.partitions.empty()) {
    const auto [columns, rows] = parse_partitions(arguments.partitions);
    apply_override(loaded, fmt::format("deployment.partition_columns={}", columns), "--partitions");
    apply_override(loaded, fmt::format("deployment.partition_rows={}", rows), "--partitions");
  }
  return loaded;
}

Resolved resolve(const LoadedExperiment& loaded, const RunArguments& arguments, Notes notes) {
  const PlacedRobots placed = place_robots(loaded);
  Resolved resolved;
  proto::Manifest& manifest = resolved.manifest;
  manifest.set_format(1);
  manifest.set_run(new_run_id());
  manifest.set_build(std::string(build_identity()));
  *manifest.mutable_experiment() = with_counts(loaded, placed);
  use_measured_radio(*manifest.mutable_experiment());
  manifest.mutable_x_mm()->Add(placed.x_mm.begin(), placed.x_mm.end());
  manifest.mutable_y_mm()->Add(placed.y_mm.begin(), placed.y_mm.end());
  manifest.mutable_heading_rad()->Add(placed.heading_rad.begin(), placed.heading_rad.end());
  for (proto::LightRaster& raster : read_light_rasters(loaded)) *manifest.add_light_raster() = std::move(raster);
  std::vector<std::uint32_t> counts;
  for (const proto::RobotGroup& group : manifest.experiment().robots()) counts.push_back(group.count());
  for (proto::RobotEeprom& eeprom : read_eeproms(loaded, counts)) *manifest.add_eeprom() = std::move(eeprom);
  manifest.set_mode(arguments.mode);
  manifest.set_pace(parse_pace(arguments.pace));
  if (arguments.max_lateness_ms > 0 && manifest.pace() == 0)
    throw UserError("--max-lateness: a run without a pace is never late; give --pace 1 as well, or leave it away");
  if (arguments.max_lateness_ms > 0) manifest.set_max_lateness_ms(arguments.max_lateness_ms);
  manifest.set_resumed(!arguments.resume.empty());
  resolved.objects = build_programs(loaded, arguments, manifest, notes);
  if (arguments.record_for_page && placed.x_mm.size() <= kMostRobotsForPage)
    record_for_page(contents_of(resolved.objects), *manifest.mutable_experiment()->mutable_recording());
  add_recorded_variables(loaded, resolved.objects, manifest);
  check_observables(loaded, manifest);
  resolved.plugins = build_plugins(loaded, arguments, manifest);
  return resolved;
}

void write_programs(const LoadedExperiment& loaded, const Resolved& resolved,
                    const recorder::RunDirectory& directory) {
  for (int i = 0; i < resolved.manifest.program_size(); ++i) {
    fs::copy_file(resolved.objects[static_cast<std::size_t>(i)],
                  directory.program(settings_of(resolved.manifest.program(i))),
                  fs::copy_options::overwrite_existing);
  }
  copy_sources(loaded, directory.programs());
  copy_plugins(loaded, resolved.manifest, resolved.plugins, directory.path() / "plugins");
}

Prepared prepare(const RunArguments& arguments) {
  const LoadedExperiment loaded = load_with_overrides(arguments);
  if (arguments.mode == "federated" && !arguments.prepare) check_processes(loaded.experiment.deployment());
  Resolved resolved = resolve(loaded, arguments, Notes::kPrinted);
  proto::Manifest& manifest = resolved.manifest;
  fs::path checkpoint;
  if (manifest.resumed()) {
    checkpoint = checkpoint_directory(arguments.resume);
    const RunPlan plan(manifest);
    if (const Tick from = read_checkpoint(checkpoint, manifest).tick; from >= plan.last_tick) {
      throw UserError(fmt::format(
          "--resume: {} was saved at {:.3f} s, and the run ends at {:.3f} s; give a longer --duration",
          checkpoint.string(), plan.tick_length.seconds_at(from), plan.tick_length.seconds_at(plan.last_tick)));
    }
  }

  const proto::Experiment& experiment = manifest.experiment();
  std::vector<fs::path> inputs{arguments.experiment, arguments.model, arguments.resume};
  for (const proto::RobotGroup& group : loaded.experiment.robots()) {
    for (const std::string& source : group.behaviour()) inputs.push_back(loaded.resolve(source));
  }
  for (const proto::VirtualEnvironment& environment : loaded.experiment.station().environment()) {
    for (const std::string& source : environment.plugin().source()) inputs.push_back(loaded.resolve(source));
  }
  auto directory = make_output(arguments.output,
                               recorder::RunDirectory::default_path(experiment.name(), experiment.seed()), inputs);
  try {
    write_programs(loaded, resolved, directory);
    if (manifest.resumed()) fs::copy(checkpoint, directory.path() / "resumed");
    os::write_file(directory.experiment(), experiment_as_run(loaded, manifest, directory));
    recorder::write_provenance(recorder::provenance_of_this_process(), directory.provenance());
    directory.write_manifest(manifest);
  } catch (const std::exception& error) {
    std::error_code ignored;
    fs::remove_all(directory.path(), ignored);
    const auto* const copying = dynamic_cast<const fs::filesystem_error*>(&error);
    if (copying == nullptr) throw;
    throw RunError(fmt::format("{}: cannot be copied to {}: {}", copying->path1().string(),
                               copying->path2().string(), copying->code().message()));
  }
  return {std::move(directory), std::move(manifest)};
}

proto::Manifest read_manifest(const recorder::RunDirectory& directory) {
  proto::Manifest manifest = directory.read_manifest();
  const std::string file = directory.manifest().string();
  check_values({manifest.experiment(), file, SourceLocations(file)});
  const auto require = [&](bool right, std::string_view what) {
    if (!right) throw UserError(fmt::format("{}: {}; prepare the run again", file, what));
  };
  const auto within = [](const google::protobuf::RepeatedField<double>& values, double bound) {
    return std::all_of(values.begin(), values.end(), [bound](double value) { return std::abs(value) <= bound; });
  };
  require(manifest.x_mm_size() >= 1 && static_cast<std::uint32_t>(manifest.x_mm_size()) <= kMostRobots,
          "the number of robots is out of range");
  require(within(manifest.x_mm(), kFarthest_mm) && within(manifest.y_mm(), kFarthest_mm) &&
              within(manifest.heading_rad(), 2 * kPi),
          "an initial pose is out of range");
  require(manifest.experiment().deployment().hosts() <= static_cast<std::uint32_t>(manifest.x_mm_size()),
          "there are more hosts than robots");
  require(manifest.pace() == 0 || (manifest.pace() >= kSlowestPace && manifest.pace() <= kFastestPace),
          "the pace is out of range");
  return manifest;
}

}  // namespace kilotwin::cli
