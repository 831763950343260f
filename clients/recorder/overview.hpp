/// The data of a recording for the pictures of its run, read in one pass.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

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
  std::vector<double>
      cell_mm;  ///< per robot: the side of its square if it is a cell of a Kilogrid, else 0; empty: no cells
  /// Number of cells among the robots.
  [[nodiscard]] std::uint32_t cells() const;
};

/// Reads all remaining records. Throws UserError if there is no state among them.
[[nodiscard]] RunOverview read_overview(Reader& recording);

}  // namespace kilotwin::recorder
