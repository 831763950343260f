#include "clients/movie/movie.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "clients/movie/encoder.hpp"
#include "clients/movie/rasteriser.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/timed_states.hpp"
#include "core/base/error.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::movie {
namespace {

constexpr double kLongest_s = 30;

/// 1, 2, 5, 10, 20...: the least with which so much simulated time fits into kLongest_s.
double fitting_pace(double simulated_s) {
  double decade = 1;
  for (;;) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (simulated_s <= kLongest_s * step * decade) return step * decade;
    }
    decade *= 10;
  }
}

/// Draws frames in batches on several threads, and encodes them in order.
class Studio {
 public:
  Studio(const FrameArtist& artist, const Look& look, Encoder& encoder, std::uint32_t threads)
      : artist_(artist), look_(look), encoder_(encoder), pool_(threads), batch_(4 * std::size_t{pool_.threads()}) {}

  void add(const recorder::Snapshot& at, const recorder::Floors& floors, const Trails& trails) {
    waiting_.push_back({at, floors, trails.positions()});
    if (waiting_.size() == batch_) flush();
  }
  void flush() {
    std::vector<std::vector<std::uint8_t>> pictures(waiting_.size());
    pool_.for_each(waiting_.size(), [&](std::size_t i) {
      const Frame& frame = waiting_[i];
      pictures[i] = rasterised(artist_.svg(frame.at, frame.floors, frame.trails), look_.width_px, look_.height_px);
    });
    for (const std::vector<std::uint8_t>& picture : pictures) encoder_.add(picture);
    waiting_.clear();
  }

 private:
  struct Frame {
    recorder::Snapshot at;
    recorder::Floors floors;
    std::deque<Positions> trails;
  };
  const FrameArtist& artist_;
  const Look& look_;
  Encoder& encoder_;
  os::WorkerPool pool_;
  std::size_t batch_;
  std::vector<Frame> waiting_;
};

}  // namespace

Made make_movie(const std::filesystem::path& recording, const Movie& movie,
                const std::function<void(double)>& progress) {
  const std::optional<Format> format = format_of(movie.file);
  KILOTWIN_DEMAND(format.has_value());
  recorder::Reader reader(recording);
  const recorder::RunOverview run = recorder::read_overview(reader);
  const double first_s = std::max(movie.from_s, run.paths.first().time_s);
  const double last_s = std::min(movie.to_s.value_or(run.paths.last().time_s), run.paths.last().time_s);
  if (last_s < first_s)
    throw UserError(fmt::format("{}: holds no state from {:g} s to {:g} s; it ends at {:g} s", recording.string(),
                                first_s, movie.to_s.value_or(last_s), run.paths.last().time_s));
  Made made;
  made.times_real = movie.times_real.value_or(fitting_pace(last_s - first_s));
  Look look = movie.look;
  look.times_real = made.times_real;
  const FrameArtist artist(run, look);
  Encoder encoder(movie.file, *format, look.width_px, look.height_px, movie.frames_per_s);
  Studio studio(artist, look, encoder, movie.threads);
  Trails trails(look.trail_s);
  recorder::TimedStates states(recording);
  for (;; ++made.frames) {
    const double time_s = first_s + static_cast<double>(made.frames) * made.times_real / movie.frames_per_s;
    if (time_s > last_s) break;
    const std::optional<recorder::Snapshot> at = states.at(time_s);
    if (!at) break;
    studio.add(*at, states.floors(), trails);
    trails.add(*at);
    if (progress) progress(last_s > first_s ? (time_s - first_s) / (last_s - first_s) : 1);
  }
  studio.flush();
  encoder.finish();
  made.duration_s = static_cast<double>(made.frames) / movie.frames_per_s;
  return made;
}

}  // namespace kilotwin::movie
