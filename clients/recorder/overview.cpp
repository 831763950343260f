#include "clients/recorder/overview.hpp"

#include <fmt/format.h>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Number of positions kept for the paths of all robots together.
constexpr std::size_t kPathPoints = 160'000;

}  // namespace

RunOverview read_overview(Reader& recording) {
  const TickLength length = recording.tick_length();
  RunOverview run{recording.header(),
                  Paths(recording.header().robots(), kPathPoints),
                  Film(recording.header().robots()),
                  {},
                  {}};
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
