// How small robots may be in a picture: drawn discs that the detector finds, by their radius, as they are and in a picture that is
// enlarged to twice its size. Usage: drawn_discs. Prints the table of docs/results/camera-tracker.md.
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "clients/track/brightness.hpp"
#include "clients/track/detect.hpp"
#include "tests/clients/track/drawn_scene.hpp"

namespace {

using namespace kilotwin::track;

struct Condition {
  const char* name;
  double noise, uneven;
  bool touching;
  int clutter;
};

constexpr Condition kConditions[] = {
    {"uneven light, 40 %", 3, 0.4, false, 0},
    {"touching, groups of seven", 3, 0.2, true, 0},
    {"clutter: 25 cables, bars, boxes", 3, 0.2, false, 25},
    {"touching, clutter, noise of 8 levels together", 8, 0.2, true, 25},
};
constexpr double kRadii_px[] = {3, 4, 5, 6, 7, 8, 12};
constexpr int kRobots = 40;

struct Count {
  int found = 0, wrong = 0;
};

Count count_in(const DrawnScene& scene, double zoom) {
  cv::Mat grey = grey_of(draw(scene));
  if (zoom > 1) cv::resize(grey, grey, {}, zoom, zoom, cv::INTER_CUBIC);
  Detector detector;
  const std::vector<Detection> found = detector.find(grey);
  Count count;
  for (const DrawnRobot& robot : scene.robots) {
    for (const Detection& detection : found) {
      // The middle of the first pixel is (0, 0) in both pictures.
      const double x = (detection.disc.centre.x_px + 0.5) / zoom - 0.5,
                   y = (detection.disc.centre.y_px + 0.5) / zoom - 0.5;
      if (std::hypot(x - robot.disc.centre.x_px, y - robot.disc.centre.y_px) > 0.3 * robot.disc.radius_px) continue;
      ++count.found;
      break;
    }
  }
  count.wrong = static_cast<int>(found.size()) - count.found;
  return count;
}

}  // namespace

int main() {
  std::printf("| condition | picture |");
  for (const double radius_px : kRadii_px) std::printf(" %g px |", radius_px);
  std::printf("\n|---|---|");
  for (std::size_t i = 0; i < std::size(kRadii_px); ++i) std::printf("---|");
  std::printf("\n");
  for (const Condition& c : kConditions) {
    for (const double zoom : {1.0, 2.0}) {
      std::printf("| %s | %s |", c.name, zoom == 1 ? "as it is" : "enlarged");
      for (const double radius_px : kRadii_px) {
        Count sum;
        for (const std::uint64_t seed : {1U, 2U}) {
          DrawnScene scene;
          scene.seed = seed;
          scene.noise = c.noise;
          scene.uneven = c.uneven;
          scene.clutter = c.clutter;
          scene.width_px = cvRound(70 * radius_px);
          scene.height_px = cvRound(52 * radius_px);
          scene.robots = scatter(scene, kRobots, radius_px, c.touching);
          const Count one = count_in(scene, zoom);
          sum.found += one.found;
          sum.wrong += one.wrong;
        }
        std::printf(" %d, %d |", sum.found, sum.wrong);
        std::fflush(stdout);
      }
      std::printf("\n");
    }
  }
  return 0;
}
