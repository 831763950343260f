#include "clients/identify/kilogrid/export_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_reporter.hpp"
#include "core/base/error.hpp"
#include "core/base/time.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::kilogrid {

std::uint64_t export_cells(recorder::Reader& recording, const std::filesystem::path& csv) {
  const proto::RecordingHeader& header = recording.header();
  const Floor floor{header.arena_width_mm(), header.arena_height_mm(), Floor{}.cell_mm};
  const auto whole = [&](double mm) { return std::fmod(mm, 2 * floor.cell_mm) == 0 && mm > 0; };
  if (!whole(floor.width_mm) || !whole(floor.height_mm)) {
    throw UserError(
        fmt::format("{}: the arena is {:g} x {:g} mm; a Kilogrid export needs sides that are multiples of {:g} mm",
                    recording.path().string(), floor.width_mm, floor.height_mm, 2 * floor.cell_mm));
  }
  constexpr double kMost_s = 2;  // period of the cells' reports; recordings with a longer one would lack some
  if (header.every_s() > kMost_s) {
    throw UserError(fmt::format(
        "{}: recorded every {:g} s; cells report every 2 s, so set recording.every_s to 2 or less and run again",
        recording.path().string(), header.every_s()));
  }
  const TickLength tick(header.tick_cycles());
  FloorReporter reporter(floor, FloorRadio(), header.robots(), header.seed());
  double last_s = 0;
  while (const proto::Record* record = recording.next()) {
    if (!record->has_state()) continue;
    const proto::StateRecord& state = record->state();
    last_s = tick.seconds_at(Tick{state.tick()});
    for (int i = 0; i < state.x_mm_size(); ++i) {
      reporter.see(static_cast<std::uint32_t>(i), last_s, state.x_mm(i) + floor.width_mm / 2,
                   state.y_mm(i) + floor.height_mm / 2);
    }
  }
  struct Row {
    double time_s;
    std::uint32_t robot;
    double x_mm, y_mm;
  };
  std::vector<Row> rows;
  for (const FloorTrack& track : reporter.take("", last_s).tracks) {
    for (std::size_t i = 0; i < track.size(); ++i)
      rows.push_back({track.time_s[i], track.robot, track.x_mm[i], track.y_mm[i]});
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.time_s < b.time_s; });
  CsvWriter writer(csv, "time_s,robot,x_mm,y_mm");
  for (const Row& row : rows) {
    fmt::format_to(std::back_inserter(writer.rows()), "{:g},{},{:g},{:g}\n", row.time_s, row.robot, row.x_mm,
                   row.y_mm);
    writer.flush_if_long();
  }
  writer.close();
  return rows.size();
}

}  // namespace kilotwin::kilogrid
