// `kilotwin-vision movie`: a video file of a recorded run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "clients/cli/commands.hpp"
#include "clients/cli/progress.hpp"
#include "clients/movie/encoder.hpp"
#include "clients/movie/movie.hpp"
#include "clients/recorder/run_directory.hpp"
#include "core/base/error.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

struct MovieArguments {
  std::filesystem::path run;
  movie::Movie movie;
  std::optional<std::string> size;
  std::optional<double> frames_per_s;
  bool force = false, quiet = false;
};

/// "1280x720". Videos need even numbers.
void set_size(movie::Look& look, const std::string& words) {
  const char* const end = words.data() + words.size();
  const auto width = std::from_chars(words.data(), end, look.width_px);
  const bool has_height = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_height ? std::from_chars(width.ptr + 1, end, look.height_px) : width;
  if (!has_height || height.ec != std::errc() || height.ptr != end || look.width_px < 320 || look.height_px < 240 ||
      look.width_px > 7680 || look.height_px > 4320 || look.width_px % 2 != 0 || look.height_px % 2 != 0)
    throw UserError(fmt::format("--size {}: is no size; give WxH, both even, from 320x240 to 7680x4320", words));
}

int show(MovieArguments& arguments) {
  movie::Movie& movie = arguments.movie;
  const std::optional<movie::Format> format = movie::format_of(movie.file);
  if (!format)
    throw UserError(
        fmt::format("{}: is no known format; give a name that ends in .mp4, .webm or .gif", movie.file.string()));
  if (std::filesystem::exists(movie.file) && !arguments.force)
    throw UserError(fmt::format("{}: exists; give another name, or --force", movie.file.string()));
  if (*format == movie::Format::kGif) {
    movie.look.width_px = 640;
    movie.look.height_px = 480;
    movie.frames_per_s = 12.5;
  }
  if (arguments.size) set_size(movie.look, *arguments.size);
  if (arguments.frames_per_s) movie.frames_per_s = *arguments.frames_per_s;
  if (movie.to_s && *movie.to_s < movie.from_s)
    throw UserError(fmt::format("--to {:g}: is before --from {:g}", *movie.to_s, movie.from_s));
  movie.threads = os::cores();
  const auto run = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kRecording);
  Progress progress(!arguments.quiet);
  const movie::Made made =
      movie::make_movie(run.recording(), movie, [&](double share) { progress.show(share, "drawing"); });
  progress.clear();
  if (!arguments.quiet)
    fmt::print("{}: {} frames, {:.1f} s at {:g} times real time\n", movie.file.string(), made.frames,
               made.duration_s, made.times_real);
  return kDone;
}

}  // namespace

Command add_movie(CLI::App& program) {
  const auto arguments = std::make_shared<MovieArguments>();
  movie::Movie& movie = arguments->movie;
  CLI::App& app = *program.add_subcommand("movie", "a video file of a recorded run: .mp4, .webm or .gif");
  app.add_option("RUN", arguments->run, "directory of a recorded run")->required();
  app.add_option("-o,--out", movie.file, "the file; its name's end says the format")->required()->type_name("FILE");
  app.add_flag("--force", arguments->force, "replace the file where it exists");
  app.add_option(
         "--speed", movie.times_real,
         "simulated time over the movie's time (default: 1, 2, 5, 10, 20..., so that it lasts at most 30 s)")
      ->check(CLI::Range(1e-3, 1e6).description(""))
      ->type_name("FACTOR");
  app.add_option("--fps", arguments->frames_per_s, "frames per second (default: 30; .gif 12.5)")
      ->check(CLI::Range(1.0, 120.0).description(""))
      ->type_name("N");
  app.add_option("--from", movie.from_s, "simulated time of the first frame, s")
      ->check(CLI::Range(0.0, 1e9).description(""))
      ->type_name("S");
  app.add_option("--to", movie.to_s, "no frame later than this, s (default: the end)")->type_name("S");
  app.add_option("--size", arguments->size, "of the picture, px (default: 1280x720; .gif 640x480)")
      ->type_name("WxH");
  app.add_option("--trail", movie.look.trail_s, "simulated time that trails reach back, s; 0: no trails")
      ->check(CLI::Range(0.0, 1e6).description(""))
      ->capture_default_str()
      ->type_name("S");
  app.add_flag("--whole-arena", movie.look.whole_arena, "also where robots take up a small part of it");
  app.add_option("--caption", movie.look.caption, "a line below the arena")->type_name("TEXT");
  app.add_flag("--quiet", arguments->quiet, "no progress and no summary on the screen");
  app.footer("Example: kilotwin movie runs/disperse-1 -o disperse.mp4 --speed 10");
  return {&app, [arguments] { return show(*arguments); }};
}

}  // namespace kilotwin::cli
