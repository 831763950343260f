/// The data of a recording for the pictures of its run, read in one pass.
#pragma once

#include <cstdint>
#include <map>

#include "clients/recorder/film.hpp"
#include "clients/recorder/paths.hpp"
#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// The pictures that virtual environments have painted, by environment.
using Floors = std::map<std::uint32_t, proto::FloorRecord>;

struct RunOverview {
  proto::RecordingHeader header;
  Paths paths;
  Film film;
  Floors first_floors, last_floors;
};

/// Reads all remaining records. Throws UserError if there is no state among them.
[[nodiscard]] RunOverview read_overview(Reader& recording);

}  // namespace kilotwin::recorder
