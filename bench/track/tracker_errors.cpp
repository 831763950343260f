// The errors of a camera tracker over minutes, in the terms of the station's camera model (station { camera { } }): a run's own
// trajectories are rendered as pictures of ARK's scale and tracked. Usage: tracker_errors TRAJECTORIES.csv
//
// The table comes from `kilotwin export --trajectories --every 0.1`. bench/camera-model makes it, and writes the page.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <optional>
#include <vector>

#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/pose.hpp"
#include "core/csv/csv_reader.hpp"
#include "idl/experiment.pb.h"

namespace {

using namespace kilotwin;

constexpr double kSide_mm = 2000, kPixelsPerMm = 1;
constexpr double kMatch_mm = 8;          ///< a track farther away is not this robot's
constexpr double kSwapDistance_mm = 40;  ///< default of the camera model
constexpr double kSettled_s = 2;         ///< from the first picture; the tracker has its robots then

struct Seen {
  Pose pose;
  std::uint8_t led = 0;
};
using Frames = std::map<double, std::vector<Seen>>;

Frames frames_of(const char* file) {
  CsvReader table(file);
  const std::size_t time = table.column("time_s"), robot = table.column("robot"), x = table.column("x_mm"),
                    y = table.column("y_mm"), heading = table.column("heading_rad"), r = table.column("led_r"),
                    g = table.column("led_g"), b = table.column("led_b");
  Frames frames;
  while (table.next()) {
    std::vector<Seen>& robots = frames[table.number(time)];
    const std::uint32_t id = table.whole(robot);
    if (id >= robots.size()) robots.resize(id + 1);
    robots[id] = {{table.number(x), table.number(y), table.number(heading)},
                  static_cast<std::uint8_t>(table.whole(r) | table.whole(g) << 2 | table.whole(b) << 4)};
  }
  return frames;
}

struct Robot {
  std::optional<std::uint32_t> track;  ///< its last one
  bool missed = false;
};

struct Tally {
  double robot_s = 0, close_pair_s = 0, missed_s = 0, square_mm = 0, heading_rad = 0, cpu_s = 0;
  long sightings = 0, headings = 0, losses = 0, swaps = 0, leds = 0, led_wrong = 0, frames = 0;
};

class Judge {
 public:
  void look(const std::vector<Seen>& truth, double period_s, const track::PictureTracker& tracker) {
    robots_.resize(truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      tally.robot_s += period_s;
      for (std::size_t j = i + 1; j < truth.size(); ++j) {
        if (distance(truth[i].pose, truth[j].pose.x_mm, truth[j].pose.y_mm) < kSwapDistance_mm)
          tally.close_pair_s += period_s;
      }
      look(i, truth[i], period_s, tracker);
    }
  }
  Tally tally;

 private:
  static double distance(const Pose& pose, double x_mm, double y_mm) {
    return std::hypot(pose.x_mm - x_mm, pose.y_mm - y_mm);
  }
  void look(std::size_t i, const Seen& truth, double period_s, const track::PictureTracker& tracker) {
    const track::Track* mine = nullptr;
    double off_mm = kMatch_mm;
    for (const track::Track& track : tracker.follower().tracks()) {
      const double d = distance(truth.pose, track.position.x_mm(), track.position.y_mm());
      if (!track.confirmed || !track.sighting || d >= off_mm) continue;
      off_mm = d;
      mine = &track;
    }
    Robot& robot = robots_[i];
    tally.missed_s += mine == nullptr ? period_s : 0;
    tally.losses += mine == nullptr && !robot.missed ? 1 : 0;
    robot.missed = mine == nullptr;
    if (mine == nullptr) return;
    ++tally.sightings;
    tally.square_mm += off_mm * off_mm;
    if (const auto heading = mine->heading_filter.heading()) {
      tally.heading_rad += std::abs(wrapped(heading->heading_rad - truth.pose.heading_rad));
      ++tally.headings;
    }
    ++tally.leds;
    tally.led_wrong += track::bits_of(*mine->led_read) != truth.led ? 1 : 0;
    const bool was_anothers = std::any_of(robots_.begin(), robots_.end(), [&](const Robot& other) {
      return &other != &robot && other.track == mine->id;
    });
    if (robot.track && *robot.track != mine->id && was_anothers) ++tally.swaps;
    robot.track = mine->id;
  }

  std::vector<Robot> robots_;
};

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void print(const Tally& t) {
  const double hours = t.robot_s / 3600, pair_hours = t.close_pair_s / 3600;
  std::printf("| quantity | field | measured |\n|---|---|---|\n");
  std::printf("| frames, robot-hours | | %ld, %.2f |\n", t.frames, hours);
  std::printf("| position, root mean square along one axis, mm | `position_noise_mm` | %.3f |\n",
              std::sqrt(t.square_mm / static_cast<double>(2 * std::max(1L, t.sightings))));
  std::printf("| heading, mean absolute error, degrees | from motion, LED and body | %.2f |\n",
              180 / kPi * t.heading_rad / static_cast<double>(std::max(1L, t.headings)));
  std::printf("| class of a LED wrong in one picture | `led_error` | %.5f |\n",
              static_cast<double>(t.led_wrong) / static_cast<double>(std::max(1L, t.leds)));
  // The standard errors of rates are those of Poisson counts.
  std::printf("| losses per robot and hour | `losses_per_hour` | %.2f +- %.2f |\n",
              static_cast<double>(t.losses) / hours, std::sqrt(static_cast<double>(t.losses)) / hours);
  std::printf("| mean length of a loss, s | `lost_s` | %.2f |\n",
              t.losses == 0 ? 0 : t.missed_s / static_cast<double>(t.losses));
  std::printf("| exchanges per hour of a pair closer than 40 mm (%.2f h) | `swaps_per_hour` | %.2f |\n", pair_hours,
              pair_hours > 0 ? 0.5 * static_cast<double>(t.swaps) / pair_hours : 0);
  std::printf("| processor time per picture, s | a part of `latency_s` | %.3f |\n",
              t.cpu_s / static_cast<double>(std::max(1L, t.frames)));
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fprintf(stderr, "usage: tracker_errors TRAJECTORIES.csv\n");
    return 2;
  }
  cv::setNumThreads(1);
  const Frames frames = frames_of(words[1]);
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(kSide_mm);
  experiment.mutable_arena()->set_height_mm(kSide_mm);
  const auto side_px = static_cast<int>(kSide_mm * kPixelsPerMm);
  cameras::CameraModel camera = cameras::CameraModel::overhead(side_px, side_px, kPixelsPerMm);
  camera.read_noise = 3;
  camera.uneven_light = 0.2;
  camera.blur_px = 0.7;
  cameras::Renderer renderer(World(experiment), camera);
  const double half_px = 0.5 * (side_px - 1);
  track::PictureTracker tracker(
      track::FloorMap::plane({kPixelsPerMm, 0, half_px, 0, -kPixelsPerMm, half_px, 0, 0, 1}));
  Judge judge;
  cv::Mat picture;
  std::uint64_t number = 0;
  double last_s = 0;
  for (const auto& [time_s, robots] : frames) {
    cameras::Scene scene;
    for (std::uint32_t i = 0; i < robots.size(); ++i) {
      cameras::RobotView& view = scene.robots.emplace_back();
      view.robot = i;
      view.pose = robots[i].pose;
      view.led = robots[i].led;
    }
    renderer.render(scene, number++, picture);
    const double begun_s = cpu_s();
    static_cast<void>(tracker.process(picture, time_s));
    const double took_s = cpu_s() - begun_s;
    if (time_s >= frames.begin()->first + kSettled_s) {
      judge.look(robots, time_s - last_s, tracker);
      judge.tally.cpu_s += took_s;
      ++judge.tally.frames;
    }
    last_s = time_s;
  }
  print(judge.tally);
  return 0;
}
