// The errors of a camera tracker over minutes, in the terms of the station's camera model (station { camera { } }): a run's own
// trajectories are rendered as pictures of ARK's scale and tracked. Usage: tracker_errors NAME TRAJECTORIES.csv SIDE_mm [LED_DEGREES]
//
// LED_DEGREES: the direction of the LEDs from the headings, if the tracker is to know it from the start.
// Prints a row of a table. The trajectories come from `kilotwin export --trajectories --every PERIOD`; there is a picture for each of
// their times. SIDE_mm: of the arena. bench/camera-model makes the trajectories, and writes the page.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "core/base/pose.hpp"
#include "core/csv/csv_reader.hpp"
#include "idl/experiment.pb.h"

namespace {

using namespace kilotwin;

constexpr double kPixelsPerMm = 1;
constexpr double kMargin_mm = 50;        ///< around the arena, in the picture
constexpr double kMatch_mm = 8;          ///< a track farther away is not this robot's
constexpr double kSwapDistance_mm = 40;  ///< default of the camera model
constexpr double kNormal975 = 1.959964;
constexpr double kSettled_s =
    10;  ///< from the first picture; the tracker has its robots then, and headings of those that drive

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
  double robot_s = 0, close_pair_s = 0, missed_s = 0, square_mm = 0, heading_rad = 0;
  long sightings = 0, headings = 0, losses = 0, led_wrong = 0, late = 0;
  long beyond = 0;             ///< headings whose error exceeds what 95 % of a normal distribution do not
  long swaps = 0;              ///< pairs of which one robot is followed by the track that followed the other
  std::vector<double> cpu_ms;  ///< of each picture
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
    }
    std::vector<std::optional<std::uint32_t>> now(truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) now[i] = look(i, truth[i], period_s, tracker);
    const auto takes = [&](std::size_t i, std::size_t j) {  // i is followed by the track that followed j
      return now[i] && robots_[i].track && now[i] != robots_[i].track && now[i] == robots_[j].track;
    };
    for (std::size_t i = 0; i < truth.size(); ++i)
      for (std::size_t j = i + 1; j < truth.size(); ++j) tally.swaps += takes(i, j) || takes(j, i) ? 1 : 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      if (now[i]) robots_[i].track = now[i];
  }
  Tally tally;

 private:
  static double distance(const Pose& pose, double x_mm, double y_mm) {
    return std::hypot(pose.x_mm - x_mm, pose.y_mm - y_mm);
  }
  /// Compares the nearest track with a robot; returns its number. Nothing: the robot is missed.
  std::optional<std::uint32_t> look(std::size_t i, const Seen& truth, double period_s,
                                    const track::PictureTracker& tracker) {
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
    if (mine == nullptr) return std::nullopt;
    ++tally.sightings;
    tally.square_mm += off_mm * off_mm;
    if (const auto heading = mine->heading()) {
      const double off_rad = std::abs(wrapped(heading->heading_rad - truth.pose.heading_rad));
      tally.heading_rad += off_rad;
      tally.beyond += off_rad > kNormal975 * std::sqrt(heading->variance_rad2) ? 1 : 0;
      ++tally.headings;
    }
    tally.led_wrong += track::bits_of(*mine->led_read) != truth.led ? 1 : 0;
    return mine->id;
  }

  std::vector<Robot> robots_;
};

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A rate of independent events: count per `unit`, and the 95 % interval of Poisson counts by Byar's approximation (Breslow and
/// Day 1987).
std::string rate(long count, double units) {
  const auto k = static_cast<double>(count);
  const auto bound = [](double n, double z) {
    const double root = 1 - 1 / (9 * n) + z / (3 * std::sqrt(n));
    return n * root * root * root;
  };
  const double low = count == 0 ? 0 : bound(k, -kNormal975), high = bound(k + 1, kNormal975);
  if (units <= 0) return "";
  return fmt::format("{:.2g} ({:.2g} to {:.2g})", k / units, low / units, high / units);
}

void print(const char* name, Tally t) {
  std::sort(t.cpu_ms.begin(), t.cpu_ms.end());
  const auto frames = static_cast<double>(std::max<std::size_t>(1, t.cpu_ms.size()));
  double cpu_ms = 0;
  for (const double one : t.cpu_ms) cpu_ms += one;
  fmt::print(
      "| {} | {:.2f} | {:.3f} | {:.1f} | {:.1f} | {} | {} | {:.2f} | {} | {:.3g} | {:.0f}, {:.0f} | {} |\n", name,
      t.robot_s / 3600, std::sqrt(t.square_mm / static_cast<double>(2 * std::max(1L, t.sightings))),
      180 / kPi * t.heading_rad / static_cast<double>(std::max(1L, t.headings)),
      100 * static_cast<double>(t.beyond) / static_cast<double>(std::max(1L, t.headings)),
      // Readings of one robot in successive pictures depend on each other: no interval.
      fmt::format("{:.2g}", static_cast<double>(t.led_wrong) / static_cast<double>(std::max(1L, t.sightings))),
      rate(t.losses, t.robot_s / 3600), t.losses == 0 ? 0 : t.missed_s / static_cast<double>(t.losses),
      rate(t.swaps, t.close_pair_s / 3600), t.close_pair_s / 3600, cpu_ms / frames,
      t.cpu_ms.empty() ? 0 : t.cpu_ms[t.cpu_ms.size() * 99 / 100], rate(t.late, frames));
}

}  // namespace

int main(int count, char** words) {
  if (count != 4 && count != 5) {
    std::fprintf(stderr, "usage: tracker_errors NAME TRAJECTORIES.csv SIDE_mm [LED_DEGREES]\n");
    return 2;
  }
  cv::setNumThreads(1);
  const Frames frames = frames_of(words[2]);
  const double side_mm = std::atof(words[3]);
  proto::Experiment experiment;
  experiment.mutable_arena()->set_width_mm(side_mm);
  experiment.mutable_arena()->set_height_mm(side_mm);
  const auto side_px = static_cast<int>((side_mm + 2 * kMargin_mm) * kPixelsPerMm);
  cameras::CameraModel camera = cameras::CameraModel::overhead(side_px, side_px, kPixelsPerMm);
  camera.read_noise = 3;
  camera.uneven_light = 0.2;
  camera.blur_px = 0.7;
  cameras::Renderer renderer(World(experiment), camera);
  const double half_px = 0.5 * (side_px - 1);
  track::FollowLimits limits;
  if (count == 5) limits.led_from_heading_rad = std::atof(words[4]) * kPi / 180;
  track::PictureTracker tracker(
      track::FloorMap::plane({kPixelsPerMm, 0, half_px, 0, -kPixelsPerMm, half_px, 0, 0, 1}), limits);
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
      judge.tally.cpu_ms.push_back(1e3 * took_s);
      judge.tally.late += took_s > time_s - last_s ? 1 : 0;
    }
    last_s = time_s;
  }
  print(words[1], judge.tally);
  return 0;
}
