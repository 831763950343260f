// `kilotwin-vision track`: robots of a camera or of pictures, to CSV and to DDS.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/vision/calibration_steps.hpp"
#include "clients/cli/vision/station_questions.hpp"
#include "clients/cli/vision/tracker_stream.hpp"
#include "clients/track/ark_mosaic.hpp"
#include "clients/track/calibrate.hpp"
#include "clients/track/identification.hpp"
#include "clients/track/source.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/csv/csv_writer.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

struct TrackArguments {
  std::string source, name = "camera", board, arena;
  fs::path out, calibration, calibrate;
  std::optional<std::uint32_t> domain;
  std::vector<std::string> peers;
  track::SourceOptions of_source;
  double square_mm = 0, disc_height_mm = 0;
  std::optional<double> led_direction_deg;
  bool force = false, quiet = false, identify = false;
};

/// The table of contract: a row per robot that is seen, or predicted over a short gap.
class Table {
 public:
  Table(const fs::path& file, bool calibrated, bool identifies)
      : calibrated_(calibrated),
        identifies_(identifies),
        writer_(file, fmt::format("frame,time_s,track,x_px,y_px,radius_px,heading_rad,led{}{}",
                                  calibrated ? ",x_mm,y_mm" : "", identifies ? ",robot" : "")) {}

  void add(const track::CapturedFrame& frame, const std::vector<track::TrackedRobot>& robots) {
    for (const track::TrackedRobot& robot : robots) {
      if (robot.state == track::TrackState::kLost) continue;
      auto to = std::back_inserter(writer_.rows());
      fmt::format_to(to, "{},{:.6f},{},{:.3f},{:.3f},{:.3f},{},{}", frame.number, frame.time_s, robot.track,
                     robot.disc.centre.x_px, robot.disc.centre.y_px, robot.disc.radius_px,
                     robot.heading ? fmt::format("{:.5f}", robot.heading->heading_rad) : "nan",
                     track::name_of(robot.led));
      if (calibrated_) fmt::format_to(to, ",{:.3f},{:.3f}", robot.position.x_mm, robot.position.y_mm);
      if (identifies_) fmt::format_to(to, ",{}", robot.number ? static_cast<int>(*robot.number) : -1);
      fmt::format_to(to, "\n");
    }
    writer_.flush_if_long();
  }
  void close() { writer_.close(); }

 private:
  bool calibrated_, identifies_;
  CsvWriter writer_;
};

/// Counts what passed, and says so every few seconds.
class Report {
 public:
  explicit Report(bool quiet) : quiet_(quiet), start_(Clock::now()), next_(start_ + kEvery) {}

  void add(const std::vector<track::TrackedRobot>& robots, std::uint64_t dropped) {
    ++frames_;
    for (const track::TrackedRobot& robot : robots) tracks_.insert(robot.track);
    const auto seen = std::count_if(robots.begin(), robots.end(), [](const track::TrackedRobot& robot) {
      return robot.state == track::TrackState::kSeen || robot.state == track::TrackState::kDoubt;
    });
    most_ = std::max(most_, seen);
    if (quiet_ || Clock::now() < next_) return;
    next_ = Clock::now() + kEvery;
    say(fmt::format("track: {} frames, {:.1f} a second, {} robots, {} frames dropped", frames_, rate(), seen,
                    dropped));
  }
  void end(std::uint64_t dropped) const {
    if (quiet_) return;
    fmt::print(stderr,
               "track: {} frames, {:.1f} a second, {} tracks, at most {} robots in a frame, {} frames dropped\n",
               frames_, rate(), tracks_.size(), most_, dropped);
  }

 private:
  static constexpr std::chrono::seconds kEvery{5};
  [[nodiscard]] double rate() const {
    return static_cast<double>(frames_) /
           std::max(1e-3, std::chrono::duration<double>(Clock::now() - start_).count());
  }

  const bool quiet_;
  const Clock::time_point start_;
  Clock::time_point next_;
  std::uint64_t frames_ = 0;
  std::set<std::uint32_t> tracks_;
  std::ptrdiff_t most_ = 0;
};

/// Says once that the robots are too small in the picture, or that there are none for a while.
class ScaleCheck {
 public:
  void look(const track::PictureTracker& tracker, const cv::Size& picture, bool any_robot) {
    constexpr int kPatience = 3;  ///< frames
    if (told_ || (!any_robot && ++empty_ < kPatience)) return;
    told_ = true;
    tell(tracker, picture, any_robot);
  }
  /// The source has ended.
  void end(const track::PictureTracker& tracker, const cv::Size& picture) const {
    if (!told_ && empty_ > 0) tell(tracker, picture, false);
  }

 private:
  static void tell(const track::PictureTracker& tracker, const cv::Size& picture, bool any_robot) {
    const std::string advice = track::scale_advice(any_robot ? tracker.radius_px(picture) : std::nullopt);
    if (!advice.empty()) warn("track: " + advice);
  }
  bool told_ = false;
  int empty_ = 0;
};

/// Numbers of robots by the station's identification.
class Identifier {
 public:
  explicit Identifier(const dds::Participant& participant) : questions_(participant) {}

  void take(const track::CapturedFrame& frame, std::vector<track::TrackedRobot>& robots,
            track::Follower& follower) {
    for (const track::Question& question : questions_.until(frame.capture_ns)) {
      identification_.take(question);
      if (identification_.ended() != ended_) report(robots.size());
    }
    identification_.take(1e-9 * static_cast<double>(frame.capture_ns), robots, follower);
  }

 private:
  void report(std::size_t robots) {
    ended_ = identification_.ended();
    const auto list = [](const auto& numbers) {
      return numbers.empty() ? "none" : fmt::format("{}", fmt::join(numbers, ", "));
    };
    say(fmt::format(
        "track: identification: {} of {} robots have their numbers; asked without answer: {}; answered by several "
        "or twice: {}",
        identification_.identified(), robots, list(identification_.missing()), list(identification_.doubtful())));
  }

  StationQuestions questions_;
  track::Identification identification_;
  std::uint64_t ended_ = 0;
};

void check(const TrackArguments& arguments) {
  if (!arguments.calibrate.empty()) {
    if (arguments.board.empty() || !(arguments.square_mm > 0))
      throw UserError("--calibrate: state the board, as --board 9x6 --square 25");
    return;
  }
  if (arguments.out.empty() && !arguments.domain)
    throw UserError("kilotwin track: state where the robots go: --out F.csv, --domain N, or both");
  if (arguments.identify && !arguments.domain)
    throw UserError("--identify: the station's questions come over DDS; state the run's domain with --domain N");
  std::error_code ignored;
  if (!arguments.out.empty() && arguments.out != "-" && fs::exists(arguments.out, ignored) && !arguments.force)
    throw UserError(
        fmt::format("--out {}: exists; choose another name, or replace it with --force", arguments.out.string()));
}

/// Holds a frame of a file back until its time has come, for those who listen. Nothing where a signal came meanwhile.
void keep_pace(track::CapturedFrame& frame, Clock::time_point start) {
  const Clock::time_point due =
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(frame.time_s));
  constexpr std::chrono::milliseconds kLook{50};
  while (interrupted() == 0 && Clock::now() < due)
    std::this_thread::sleep_for(std::min<Clock::duration>(due - Clock::now(), kLook));
  frame.capture_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(due.time_since_epoch()).count();
}

/// The source of pictures, and the places of its pixels on the floor.
struct View {
  std::unique_ptr<track::Source> source;
  std::optional<track::FloorMap> floor;
};

View open_view(const TrackArguments& arguments) {
  View view;
  if (!arguments.calibration.empty()) {
    const cv::Size2d arena = arguments.arena.empty() ? cv::Size2d() : two_numbers("--arena", arguments.arena);
    if (const auto ark = track::read_ark_calibration(arguments.calibration, arena)) {
      if (arguments.of_source.camera)
        throw UserError(fmt::format("--camera: {} is of four cameras together; leave --camera out",
                                    arguments.calibration.string()));
      std::error_code ignored;
      if (!fs::is_directory(arguments.source, ignored) ||
          (!arguments.of_source.watch && !track::is_ark_directory(arguments.source)))
        throw UserError(
            fmt::format("{}: {} is of ARK's four cameras; expected a directory with frame_00000_0.jpg to "
                        "frame_00000_3.jpg",
                        arguments.source, arguments.calibration.string()));
      auto directory = std::make_unique<track::ArkDirectory>(arguments.source, arguments.of_source, *ark);
      view.floor = directory->floor();
      view.source = std::move(directory);
      return view;
    }
    view.floor = track::read_calibration(arguments.calibration, arena);
  }
  view.source = track::open_source(arguments.source, arguments.of_source);
  return view;
}

void say_led_direction(const track::PictureTracker& tracker) {
  const std::optional<track::LedMount> mount = tracker.follower().led_bearing().mount();
  if (!mount) return;
  const double direction_deg = mount->from_heading_rad * 180 / kPi;
  say(fmt::format(
      "track: the LEDs are at {:.0f} degrees from the headings, by the robots that drove straight; next time, "
      "--led-direction {:.0f} gives headings from the first picture on",
      direction_deg, direction_deg));
}

int follow_robots(const TrackArguments& arguments) {
  View view = open_view(arguments);
  const std::optional<track::FloorMap> floor = view.floor;
  std::unique_ptr<track::Source> source = std::move(view.source);
  const bool live = source->live();
  std::optional<Table> table;
  // A source that fails at once leaves no table.
  const auto begin_table = [&] {
    if (!table && !arguments.out.empty()) table.emplace(arguments.out, floor.has_value(), arguments.identify);
  };
  std::optional<TrackerStream> stream;
  std::optional<Identifier> identifier;
  if (arguments.domain)
    stream.emplace(dds::Transport{*arguments.domain, arguments.peers}, arguments.name,
                   arguments.identify ? SampleIds::kNumbers : SampleIds::kTracks);
  if (arguments.identify) identifier.emplace(stream->participant());

  catch_interrupts();
  track::FollowLimits limits;
  if (arguments.led_direction_deg) limits.led_from_heading_rad = *arguments.led_direction_deg * kPi / 180;
  track::PictureTracker tracker(floor, limits);
  track::FrameQueue frames(std::move(source));
  Report report(arguments.quiet);
  ScaleCheck scale;
  cv::Size picture;
  const Clock::time_point start = Clock::now();
  while (std::optional<track::CapturedFrame> frame = frames.next([] { return interrupted() != 0; })) {
    if (stream && !live) keep_pace(*frame, start);
    std::vector<track::TrackedRobot> robots = tracker.process(frame->picture, frame->time_s);
    picture = frame->picture.size();
    scale.look(tracker, picture, !robots.empty());
    if (identifier) identifier->take(*frame, robots, tracker.follower());
    if (stream) stream->publish(frame->number, frame->capture_ns, robots);
    begin_table();
    if (table) table->add(*frame, robots);
    report.add(robots, frames.dropped());
  }
  frames.stop();
  begin_table();
  if (table) table->close();
  scale.end(tracker, picture);
  report.end(frames.dropped());
  if (!arguments.quiet && !arguments.led_direction_deg) say_led_direction(tracker);
  return kDone;
}

int track_robots(const TrackArguments& arguments) {
  check(arguments);
  if (arguments.calibrate.empty()) return follow_robots(arguments);
  const cv::Size2d corners = two_numbers("--board", arguments.board);
  const track::Board board{cvRound(corners.width), cvRound(corners.height), arguments.square_mm};
  if (board.columns < 3 || board.rows < 3) throw UserError("--board: a board has 3x3 inner corners or more");
  calibrate_from(arguments.source, board, arguments.disc_height_mm, arguments.calibrate);
  return kDone;
}

void add_calibration_options(CLI::App& app, TrackArguments& arguments) {
  const std::string group = "Calibration";
  app.add_option("--calibration", arguments.calibration,
                 "file of --calibrate, camera.xml of kilotwin cameras, or ARK's calibration; then the table has mm")
      ->type_name("F.yaml")
      ->group(group);
  app.add_option("--arena", arguments.arena, "size of the arena whose corners the calibration states, mm")
      ->type_name("WxH")
      ->group(group);
  app.add_option("--calibrate", arguments.calibrate,
                 "write this calibration from pictures of a checkerboard, and track nothing")
      ->type_name("F.yaml")
      ->group(group);
  app.add_option("--board", arguments.board, "inner corners of the checkerboard")->type_name("CxR")->group(group);
  app.add_option("--square", arguments.square_mm, "side of one square of the checkerboard, mm")
      ->type_name("MM")
      ->group(group);
  app.add_option("--height", arguments.disc_height_mm, "height of the robots' discs above the board, mm")
      ->capture_default_str()
      ->type_name("MM")
      ->group(group);
}

}  // namespace

Command add_track(CLI::App& program) {
  const auto arguments = std::make_shared<TrackArguments>();
  CLI::App& app = *program.add_subcommand("track", "poses and LEDs of real robots from a camera or from pictures");
  app.add_option("SOURCE", arguments->source,
                 "picture, video file, directory of pictures, index of a camera, or URL of a stream")
      ->required()
      ->type_name("");
  app.add_option("--out", arguments->out, "table with a row per robot and frame; - for standard output")
      ->type_name("F.csv");
  app.add_flag("--force", arguments->force, "replace the table where it exists");
  app.add_option("--domain", arguments->domain, "publish on kilotwin/tracker_frames of this DDS domain")
      ->check(CLI::Range(0U, dds::kLastDomain).description(""))
      ->type_name("N");
  app.add_option("--peer", arguments->peers, "address of a machine that takes part, this one included; repeat it")
      ->type_name("ADDRESS");
  app.add_option("--name", arguments->name, "name of this tracker in its samples")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_flag("--identify", arguments->identify,
               "robots get the numbers to which they answer when the station of the run asks for them");
  app.add_option("--led-direction", arguments->led_direction_deg,
                 "direction of the LEDs from the robots' headings, anticlockwise; without it, the tracker learns "
                 "it from robots "
                 "that drive straight, which it cannot in a jam")
      ->type_name("DEGREES")
      ->check(CLI::Range(-360.0, 360.0).description(""));
  app.add_option("--rate", arguments->of_source.rate_hz, "pictures per second of a directory")
      ->check(CLI::PositiveNumber.description(""))
      ->capture_default_str()
      ->type_name("HZ");
  app.add_flag("--watch", arguments->of_source.watch,
               "a directory grows, or a picture is rewritten: wait for the next one");
  app.add_option("--camera", arguments->of_source.camera,
                 "camera whose pictures of an ARK directory are taken; else 0, or all four with ARK's calibration")
      ->check(CLI::Range(0, 3).description(""))
      ->type_name("0..3");
  app.add_flag("--quiet", arguments->quiet, "no progress on the screen");
  add_calibration_options(app, *arguments);
  app.footer("Example: kilotwin track robots.png --out robots.csv. Ctrl-C ends a live source and keeps the table.");
  return {&app, [arguments] { return track_robots(*arguments); }};
}

}  // namespace kilotwin::cli
