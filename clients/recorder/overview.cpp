#include "clients/recorder/overview.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Number of positions kept for the paths of all robots together.
constexpr std::size_t kPathPoints = 160'000;

std::vector<double> cell_sides(const proto::RecordingHeader& header) {
  std::vector<double> sides;
  for (int group = 0; group < header.group_cell_mm_size(); ++group)
    sides.insert(sides.end(), header.group_robots(group), header.group_cell_mm(group));
  return sides;
}

}  // namespace

std::uint32_t RunOverview::cells() const {
  return static_cast<std::uint32_t>(
      std::count_if(cell_mm.begin(), cell_mm.end(), [](double side) { return side > 0; }));
}

RunOverview read_overview(Reader& recording) {
  const TickLength length = recording.tick_length();
  RunOverview run{recording.header(),
                  Paths(recording.header().robots(), kPathPoints),
                  Film(recording.header().robots()),
                  {},
                  {},
                  cell_sides(recording.header())};
  while (const proto::Record* const record = recording.next()) {
    if (record->has_state()) {
      run.paths.add(record->state(), length);
      run.film.add(record->state(), length);
    } else if (record->has_floor()) {
      run.first_floors.try_emplace(record->floor().environment(), record->floor());
      run.last_floors[record->floor().environment()] = record->floor();
    }
  }
  if (run.paths.empty()) {
    throw UserError(
        fmt::format("{}: no state to draw; the run ended before its first one", recording.path().string()));
  }
  return run;
}

}  // namespace kilotwin::recorder
