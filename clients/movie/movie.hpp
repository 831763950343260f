/// The movie of a recorded run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "clients/movie/frame_artist.hpp"

namespace kilotwin::movie {

struct Movie {
  std::filesystem::path file;        ///< .mp4, .webm or .gif
  Look look;                         ///< width and height even; times_real is set by make_movie()
  double frames_per_s = 30;          ///< of the movie
  std::optional<double> times_real;  ///< nothing: the least round number for which the movie lasts at most 30 s
  double from_s = 0;                 ///< simulated time of the first frame
  std::optional<double> to_s;        ///< no frame is later; nothing: the end of the recording
  std::uint32_t threads = 1;         ///< that draw
};

struct Made {
  std::uint64_t frames = 0;
  double duration_s = 0;  ///< of the movie
  double times_real = 1;
};

/// Draws and encodes. `progress`, called with 0..1, may be empty. Throws UserError if the recording holds no state in that time,
/// RunError if the file cannot be written.
Made make_movie(const std::filesystem::path& recording, const Movie& movie,
                const std::function<void(double)>& progress);

}  // namespace kilotwin::movie
