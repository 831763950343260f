#include "clients/cli/identify/design_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/identify/design_report.hpp"
#include "clients/cli/identify/unfinished.hpp"
#include "clients/cli/progress.hpp"
#include "clients/identify/result/result_file.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/experiment/load.hpp"
#include "core/experiment/validate.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

/// Longest recording that is planned, and the most robots: the exchange plays it hundreds of times.
constexpr double kShortest_s = 10, kLongest_s = 1800;
constexpr std::uint32_t kMostRobots = 200;

/// A model file that passes the checks of `kilotwin run --model`.
proto::Model read_model(const fs::path& file) {
  proto::Model model;
  SourceLocations locations(file.string());
  parse_text(file.string(), read_text(file, file.string()), model, locations);
  LoadedExperiment loaded{{}, "planned.txtpb", SourceLocations("planned.txtpb")};
  loaded.experiment.set_name("planned");
  loaded.experiment.set_duration_s(kShortest_s);
  loaded.experiment.mutable_arena()->set_width_mm(1000);
  loaded.experiment.mutable_arena()->set_height_mm(1000);
  proto::RobotGroup& group = *loaded.experiment.add_robots();
  group.set_count(1);
  group.set_body(proto::RobotGroup::TRACKED);
  apply_model(loaded, file);
  validate(loaded);
  return model;
}

/// The present model and its candidates, by file.
std::vector<std::pair<std::string, proto::Model>> models_of(const DesignArguments& arguments) {
  std::vector<fs::path> files = arguments.candidates;
  std::error_code ignored;
  if (files.empty()) {
    for (const fs::directory_entry& entry : fs::directory_iterator(arguments.result / "candidates", ignored))
      if (entry.path().extension() == ".txtpb") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  }
  files.insert(files.begin(), arguments.result / "model.txtpb");
  std::vector<std::pair<std::string, proto::Model>> models;
  models.reserve(files.size());
  for (const fs::path& file : files) models.emplace_back(file.string(), read_model(file));
  return models;
}

identify::PlanArena arena_of(const DesignArguments& arguments, const identification::Result& result) {
  identify::PlanArena arena;
  if (arguments.arena.empty()) {
    const identification::Walls& walls = result.walls();
    // The largest arena about the origin within the walls, which bound the disc centres.
    constexpr double kDisc_mm = 2 * kRobotRadius_mm;
    arena.width_mm = 2 * std::min(-walls.x_low_mm(), walls.x_high_mm()) + kDisc_mm;
    arena.height_mm = 2 * std::min(-walls.y_low_mm(), walls.y_high_mm()) + kDisc_mm;
    if (!walls.has_x_low_mm() || !walls.has_x_high_mm() || !walls.has_y_low_mm() || !walls.has_y_high_mm())
      throw UserError(
          fmt::format("{}: the result does not know all walls; give the arena's size in mm: --arena 1000x800",
                      (arguments.result / "result.json").string()));
  } else {
    const char *const begin = arguments.arena.data(), *const end = begin + arguments.arena.size();
    const auto [cross, error] = std::from_chars(begin, end, arena.width_mm);
    const bool wide = error == std::errc() && cross != end && *cross == 'x';
    const auto [last, failed] =
        wide ? std::from_chars(cross + 1, end, arena.height_mm) : std::from_chars(end, end, arena.height_mm);
    if (!wide || failed != std::errc() || last != end || !std::isfinite(arena.width_mm) ||
        !std::isfinite(arena.height_mm))
      throw UserError(fmt::format("--arena: is \"{}\"; give width and height in mm: 1000x800", arguments.arena));
  }
  constexpr double kSmallest_mm = 200, kLargest_mm = 100'000;
  if (!(std::min(arena.width_mm, arena.height_mm) >= kSmallest_mm &&
        std::max(arena.width_mm, arena.height_mm) <= kLargest_mm))
    throw UserError(fmt::format("--arena: {:g} mm by {:g} mm; give sides from {:g} to {:g} mm", arena.width_mm,
                                arena.height_mm, kSmallest_mm, kLargest_mm));
  return arena;
}

identify::RecordingConditions conditions_of(const DesignArguments& arguments,
                                            const identification::Result& result) {
  identify::RecordingConditions conditions;
  conditions.every_s = arguments.every_s;
  conditions.headings = !arguments.no_headings;
  const identification::Base& base = result.base();
  conditions.base.straight_mm_s = base.straight_speed_mm_s();
  conditions.base.turn_mm_s = base.turn_speed_mm_s();
  conditions.base.wheel_base_mm = base.wheel_base_mm();
  conditions.base.ahead_mm = base.tracked_point_ahead_mm();
  conditions.base.bias_sd_mm_s = base.bias_sd_mm_s();
  const auto square = [](double sd) { return sd * sd; };
  const identification::Noise& noise = result.noise();
  conditions.noise.factor_s = noise.factor_variance_s();
  conditions.noise.wheel_mm2_s = square(noise.wheel_sd_mm());
  conditions.noise.heading_rad2_s = square(noise.heading_sd_rad());
  conditions.noise.drift_mm2_s = square(noise.drift_sd_mm());
  conditions.noise.position_mm2 = square(noise.tracker_position_sd_mm());
  conditions.noise.heading_rad2 = square(noise.tracker_heading_sd_rad());
  conditions.noise.contact_rad2_s = square(noise.at_robots_sd_rad());
  if (!(conditions.base.wheel_base_mm > 0 && conditions.noise.position_mm2 > 0))
    throw UserError(fmt::format("{}: has no fitted motion; give a result of trajectories",
                                (arguments.result / "result.json").string()));
  for (const identification::Robot& robot : result.robots())
    conditions.bias_covariance[robot.robot()] =
        Eigen::Vector2d(square(robot.sd_left_mm_s()), square(robot.sd_right_mm_s())).asDiagonal();
  return conditions;
}

void check(const DesignArguments& arguments) {
  if (!(arguments.duration_s >= kShortest_s && arguments.duration_s <= kLongest_s))
    throw UserError(fmt::format("--duration: give {:g} to {:g} s", kShortest_s, kLongest_s));
  if (!(arguments.every_s >= 0.04 && arguments.every_s <= 5)) throw UserError("--every: give 0.04 to 5 s");
  if (arguments.robots > kMostRobots) throw UserError(fmt::format("--robots: give at most {}", kMostRobots));
}

void write_plan(const identify::RecordingPlan& plan, double every_s, const fs::path& out) {
  os::write_file(out / "commands.csv", commands_csv(plan, "planned"));
  os::write_file(out / "planned-poses.csv", poses_csv(plan));
  os::write_file(out / "planned.c", program_c(plan));
  os::write_file(out / "planned.txtpb",
                 experiment_text(plan, "planned", "planned.c", "planned-poses.csv", every_s));
}

}  // namespace

int plan_recording(const DesignArguments& arguments, const Output& output) {
  check(arguments);
  const identification::Result result = identify::read_result(arguments.result / "result.json");
  const std::vector<std::pair<std::string, proto::Model>> models = models_of(arguments);
  identify::DesignOptions options;
  options.arena = arena_of(arguments, result);
  options.duration_s = arguments.duration_s;
  options.robots = arguments.robots > 0
                       ? arguments.robots
                       : std::clamp(static_cast<std::uint32_t>(result.robots_size()), 1u, kMostRobots);
  options.seed = arguments.seed;
  options.threads = arguments.threads;
  const double reach_mm = std::max(options.arena.width_mm, options.arena.height_mm) / 2;
  const identify::DesignQuestion question =
      models.size() == 1 ? identify::question_of_parameters(models.front().second, result)
                         : identify::question_of_models(models, result, options.duration_s, reach_mm);
  const identify::RecordingConditions conditions = conditions_of(arguments, result);
  std::vector<fs::path> inputs = arguments.candidates;
  inputs.push_back(arguments.result);
  const fs::path fallback = "planned", out = make_plain_output(output, fallback, inputs);
  Unfinished unfinished(out);
  std::optional<WorkProgress> progress(std::in_place, !arguments.quiet);
  options.progress = [&](const stats::Work& work) { progress->begin(work); };
  const identify::Design design = design_recording(question, conditions, options);
  write_plan(design.plan, arguments.every_s, out);
  write_design_report(design, question, models.front().first, out);
  unfinished.keep();
  progress.reset();
  if (!arguments.quiet) {
    if (!fits_robots(design.plan))
      fmt::print(
          "note: planned.c has too many commands for a robot's memory; it is for simulated robots alone. "
          "For real ones give fewer --robots or a shorter --duration\n");
    for (std::size_t m = 1; m < models.size(); ++m) fmt::print("candidate: {}\n", models[m].first);
    fmt::print("{}\nplan {}: commands.csv, planned.txtpb, planned.c, planned-poses.csv, design.json, report.html\n",
               design_in_words(design, question), place_in_words(out, output, fallback));
    fmt::print(
        "next: place the robots as in planned-poses.csv, and load planned.c; or simulate: kilotwin run {} "
        "--model {}\n",
        (out / "planned.txtpb").string(), models.front().first);
  }
  return kDone;
}

}  // namespace kilotwin::cli
