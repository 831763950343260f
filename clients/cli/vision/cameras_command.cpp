// `kilotwin-vision cameras`: pictures of a live run for a station or a tracker, or of a recorded run for tests of trackers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "clients/cameras/picture_file.hpp"
#include "clients/cli/commands.hpp"
#include "clients/cli/output.hpp"
#include "clients/cli/vision/live_cameras.hpp"
#include "clients/cli/vision/recorded_cameras.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

struct CamerasArguments {
  std::optional<std::uint32_t> domain;
  std::filesystem::path run, video;
  Output output;
  LiveCameras live;
  RecordedCameras recorded;
  double frames_per_s = 30;
  std::optional<int> quality;
};

int show(CamerasArguments& arguments) {
  const CameraOptions& camera = arguments.live.camera;
  if (!arguments.run.empty()) {
    if (arguments.domain || !arguments.live.directory.empty() || !arguments.live.picture.empty() ||
        arguments.live.mjpeg)
      throw UserError("--run: renders a recorded run; leave --domain, --dir, --picture and --mjpeg away");
    RecordedCameras& recorded = arguments.recorded;
    recorded.run = arguments.run;
    recorded.video = arguments.video;
    recorded.camera = camera;
    recorded.frames_per_s = arguments.frames_per_s;
    recorded.quiet = arguments.live.quiet;
    if (arguments.quality) recorded.quality = *arguments.quality;
    if (recorded.ark && !recorded.video.empty()) throw UserError("--video: takes one camera; leave --ark away");
    recorded.out = make_plain_output(arguments.output, "pictures", {arguments.run});
    return show_recorded(recorded);
  }
  LiveCameras& live = arguments.live;
  if (!arguments.domain)
    throw UserError("cameras: give --domain N, the domain of a run, or --run RUN, a recorded one");
  if (live.directory.empty() && live.picture.empty() && !live.mjpeg)
    throw UserError("cameras: give --dir DIR, --picture FILE or --mjpeg PORT, or several of them");
  if (!live.picture.empty() && !cameras::format_of(live.picture.string()))
    throw UserError(fmt::format("--picture {}: is no known format; give a name that ends in .jpg or .png",
                                live.picture.string()));
  live.transport.domain = *arguments.domain;
  live.frames_per_s = arguments.frames_per_s;
  if (arguments.quality) live.quality = *arguments.quality;
  return show_live(live);
}

}  // namespace

Command add_cameras(CLI::App& program) {
  const auto arguments = std::make_shared<CamerasArguments>();
  CLI::App& app =
      *program.add_subcommand("cameras", "pictures of the simulated arena for a real station or tracker");
  app.add_option("--domain", arguments->domain, "DDS domain of a live run")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->type_name("N");
  app.add_option("--peer", arguments->live.transport.peers,
                 "address of a machine that takes part; repeated for each")
      ->type_name("ADDRESS");
  app.add_option("--dir", arguments->live.directory,
                 "the four cameras of ARK: a directory of frame_TIME_CAMERA.jpg that follows its reader")
      ->type_name("DIR");
  app.add_option("--picture", arguments->live.picture, "one picture, rewritten: .jpg or .png")->type_name("FILE");
  app.add_option("--mjpeg", arguments->live.mjpeg, "a stream: http://127.0.0.1:PORT/camera.mjpg; 0: a free port")
      ->type_name("PORT");
  app.add_flag("--one-run", arguments->live.one_run, "end with the run (default: wait for the next one)");
  app.add_option("--run", arguments->run, "a recorded run, instead of a live one")->type_name("RUN");
  add_output_options(app, arguments->output, "pictures, with a number added if it exists; with --run only");
  app.add_option("--video", arguments->video, "with --run: a video instead of pictures: .avi or .mp4")
      ->type_name("FILE");
  app.add_flag("--ark", arguments->recorded.ark, "with --run: the four cameras of ARK");
  app.add_flag("--png", arguments->recorded.png, "with --run: PNG pictures, which lose nothing");
  app.add_option("--from", arguments->recorded.from_s, "with --run: simulated time of the first frame, s")
      ->type_name("S");
  app.add_option("--to", arguments->recorded.to_s, "with --run: no frame later than this, s (default: the end)")
      ->type_name("S");
  app.add_option("--fps", arguments->frames_per_s,
                 "frames per second, at most: of wall time, or with --run of simulated time")
      ->check(CLI::Range(0.01, 1000.0).description(""))
      ->capture_default_str()
      ->type_name("N");
  app.add_option("--quality", arguments->quality, "of JPEG pictures, 1 to 100 (default: 90; with --run 95)")
      ->check(CLI::Range(1, 100).description(""))
      ->type_name("N");
  app.add_flag("--quiet", arguments->live.quiet, "no lines about runs and places of results");
  add_camera_options(app, arguments->live.camera);
  app.footer(
      "Example: kilotwin cameras --domain 7 --dir frames. Every picture carries its capture time in a comment.");
  return {&app, [arguments] { return show(*arguments); }};
}

}  // namespace kilotwin::cli
