#include "services/ark/station_outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/plan/station_settings.hpp"

namespace kilotwin::ark {
namespace fs = std::filesystem;
namespace {

fs::path file_of(const fs::path& run_directory, std::uint32_t environment, const char* ending) {
  return run_directory / fmt::format("station-{}.{}", environment, ending);
}

/// Removes the rows from `first_s` on, which the run writes again.
void cut_log(const fs::path& file, double first_s) {
  const auto text = os::read_if_there(file);
  if (!text) return;
  std::string kept;
  for (std::size_t begin = 0; begin < text->size();) {
    const std::size_t end = std::min(text->find('\n', begin), text->size() - 1) + 1;
    double time_s = 0;
    std::from_chars(text->data() + begin, text->data() + end, time_s);
    if (time_s < first_s) kept.append(*text, begin, end - begin);
    begin = end;
  }
  os::write_file(file, kept);
}

FloorPicture picture_of(std::uint32_t environment, const station::Floor& floor) {
  FloorPicture picture;
  picture.environment = environment;
  picture.columns = floor.columns();
  picture.rows = floor.rows();
  for (const station::Colour& cell : floor.cells()) {
    for (const std::uint8_t octet : {cell.red, cell.green, cell.blue, cell.alpha})
      picture.rgba.push_back(static_cast<char>(octet));
  }
  for (const station::Floor::Circle& circle : floor.circles) {
    const station::Colour& colour = circle.colour;
    picture.circles.push_back({circle.centre.x(),
                               circle.centre.y(),
                               circle.radius,
                               {colour.red, colour.green, colour.blue, colour.alpha},
                               circle.text});
  }
  return picture;
}

/// The least delay that `share` of the messages do not exceed; 0 where there are none.
double delay_quantile_s(const std::vector<std::uint64_t>& delays, std::uint64_t messages, double share) {
  std::uint64_t sum = 0;
  for (std::size_t bin = 0; bin < delays.size(); ++bin) {
    sum += delays[bin];
    if (sum > 0 && static_cast<double>(sum) >= share * static_cast<double>(messages))
      return static_cast<double>(bin) * kDelayBin_s;
  }
  return 0;
}

}  // namespace

StationOutputs::StationOutputs(const RunPlan& plan, fs::path run_directory, Tick first)
    : plan_(plan), run_directory_(std::move(run_directory)) {
  if (run_directory_.empty()) return;
  const auto environments = static_cast<std::uint32_t>(plan.station_settings().environments.size());
  for (std::uint32_t i = 0; i < environments; ++i)
    cut_log(file_of(run_directory_, i, "tsv"), plan.tick_length.seconds_at(first));
}

void StationOutputs::write(const PluginOutput& output) {
  if (!output.log_rows.empty()) {
    const fs::path file = file_of(run_directory_, output.environment, "tsv");
    std::ofstream log(file, std::ios::app);
    for (const std::string& row : output.log_rows) log << row << '\n';
    if (!log.flush()) throw RunError(file.string() + ": cannot be written; is the disk full?");
  }
  for (const station::Report& report : output.reports) {
    os::write_file(file_of(run_directory_, output.environment, "json"), report.json + "\n");
    if (!report.line.empty()) say(one_line(report.line));
  }
}

void StationOutputs::take(Tick from, const StationEngine& engine, RunObserver& observer) {
  for (const PluginOutput& output : engine.outputs()) {
    const std::string& name = plan_.station_settings().environments[output.environment].name;
    if (!run_directory_.empty()) write(output);
    if (!output.failure.empty()) {
      const std::string what = fmt::format("the station's plugin {} failed at {:.3f} s: {}", name,
                                           plan_.tick_length.seconds_at(from), one_line(output.failure, 400));
      if (output.ends_run) throw RunError(what);
      if (!run_directory_.empty()) say(what + "; the run goes on without it");
    }
    if (!output.floor) continue;
    FloorPicture picture = picture_of(output.environment, *output.floor);
    FloorPicture& last = floors_[output.environment];
    if (picture == last) continue;
    observer.floor(from, picture);
    last = std::move(picture);
  }
}

StationTotals station_totals(const RunPlan& plan, const StationEngine& engine, Tick last) {
  StationTotals totals;
  const auto& environments = plan.station_settings().environments;
  if (!engine.uses_queue()) return totals;
  const QueueCounts& counts = engine.counts();
  totals.packets = counts.packets;
  totals.robot_messages = counts.robot_messages;
  totals.broadcasts = counts.broadcasts;
  totals.replaced = counts.replaced;
  totals.too_wide = counts.too_wide;
  totals.sending_s = std::max(0.0, plan.tick_length.seconds_at(last) - plan.station_settings().start_broadcast_s);
  double sum_s = 0;
  for (std::size_t bin = 0; bin < counts.delays.size(); ++bin)
    sum_s += static_cast<double>(counts.delays[bin]) * (static_cast<double>(bin) + 0.5) * kDelayBin_s;
  if (counts.robot_messages > 0) totals.mean_delay_s = sum_s / static_cast<double>(counts.robot_messages);
  constexpr double kMost = 0.99;
  totals.p99_delay_s = delay_quantile_s(counts.delays, counts.robot_messages, kMost);
  totals.max_delay_s = delay_quantile_s(counts.delays, counts.robot_messages, 1);
  for (std::uint32_t i = 0; i < environments.size(); ++i)
    totals.plugins.push_back({environments[i].name, engine.failure(i)});
  return totals;
}

}  // namespace kilotwin::ark
