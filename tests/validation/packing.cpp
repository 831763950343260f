#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/base/pose.hpp"
#include "core/experiment/limits.hpp"
#include "tests/validation/validations.hpp"

namespace kilotwin::validation {
namespace {

/// A hexagonal patch of discs that touch: the densest packing there is. Everybody faces the centre.
void write_packing(const std::filesystem::path& file, std::size_t robots) {
  struct Place {
    double square, x, y;
  };
  std::vector<Place> places;
  const double pitch = 2 * kRobotRadius_mm, row = pitch * std::sqrt(0.75);
  const int reach = static_cast<int>(std::sqrt(static_cast<double>(robots))) + 2;
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      // Off the centre, so that nobody stands on the point that all drive to.
      const double x = (j + 0.5 * (i & 1) + 0.3) * pitch, y = (i + 0.2) * row;
      places.push_back({x * x + y * y, x, y});
    }
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.square != b.square ? a.square < b.square : a.x != b.x ? a.x < b.x : a.y < b.y;
  });
  std::ofstream csv(file);
  csv << "x_mm,y_mm,heading_rad\n";
  for (std::size_t i = 0; i < robots; ++i)
    csv << fmt::format("{:.17g},{:.17g},{:.17g}\n", places[i].x, places[i].y,
                       std::atan2(-places[i].y, -places[i].x));
}

/// Overlaps of pairs that touch or nearly do, mm, of all recorded states.
std::vector<double> overlaps(const Recorded& run) {
  constexpr double kNear_mm = 0.5;
  const double touching = 2 * kRobotRadius_mm;
  std::vector<double> found;
  std::vector<std::size_t> order(run.robots());
  for (std::size_t k = 0; k < run.time_s.size(); ++k) {
    const auto& x = run.x_mm[k];
    const auto& y = run.y_mm[k];
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
    for (std::size_t a = 0; a < order.size(); ++a) {
      for (std::size_t b = a + 1; b < order.size() && x[order[b]] - x[order[a]] < touching + kNear_mm; ++b) {
        const double distance = std::hypot(x[order[b]] - x[order[a]], y[order[b]] - y[order[a]]);
        if (distance < touching + kNear_mm) found.push_back(std::max(0.0, touching - distance));
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

void validate_packing(Runs& runs, Verdicts& verdicts, Effort effort) {
  const std::size_t robots = effort.quick ? 200 : 1000;
  const int seconds = effort.quick ? 15 : 60;
  verdicts.section(
      fmt::format("{} robots in the tightest packing, all driving to the centre for {} s", robots, seconds));
  const std::filesystem::path poses = runs.scratch() / "packing.csv";
  write_packing(poses, robots);
  for (const bool noise : {false, true}) {
    const std::vector<Recorded> swarm = runs.sweep(
        runs.source("experiments/straight.txtpb"),
        {"--duration", std::to_string(seconds), "--robots", std::to_string(robots), "--set",
         "robots.layout.poses.csv=" + poses.string(), "--set", noise ? "motion.noise=true" : "motion.noise=false"});
    const std::vector<double> overlap = overlaps(swarm[0]);
    const std::string with = noise ? "biases" : "no noise";
    verdicts.at_least(with + ": pairs in contact", "", {static_cast<double>(overlap.size())},
                      static_cast<double>(robots));
    verdicts.at_most(with + ": largest overlap of any pair, every second", "mm", {overlap.back()}, 0.1);
    verdicts.at_most(with + ": 99th percentile of pairs in contact", "mm", {overlap[overlap.size() * 99 / 100]},
                     0.1);
  }
}

}  // namespace kilotwin::validation
