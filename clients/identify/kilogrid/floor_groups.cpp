#include "clients/identify/kilogrid/floor_groups.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "clients/identify/kilogrid/track_windows.hpp"

namespace kilotwin::kilogrid {

const std::array<groups::FeatureScale, 12> groups::kFeatures = {
    groups::FeatureScale{{0, 20, 35, 50, 60, 70, 80, 90, 100}, 65, 25},
    groups::FeatureScale{{0, 15, 20, 25, 30, 35, 40}, 28, 10},
    groups::FeatureScale{{0, 0.01, 0.1, 0.2, 0.4, 0.7}, 0.1, 0.17},
    groups::FeatureScale{{0, 0.5, 1.5, 2.5, 4.5, 8.5}, 0.7, 1.3},
    groups::FeatureScale{{0, 0.4, 0.8, 1.2, 1.6}, 1, 0.65},
    groups::FeatureScale{{0, 0.15, 0.3, 0.45, 0.6}, 0.35, 0.3},
    groups::FeatureScale{{-4, -1, -0.4, 0, 0.4, 1}, 0, 0.85},
    groups::FeatureScale{{0, 100, 200, 300, 400, 600}, 305, 225},
    groups::FeatureScale{{0, 150, 300, 400, 500, 650}, 465, 245},
    groups::FeatureScale{{0, 0.01, 0.15, 0.35, 0.65, 0.95}, 0.17, 0.3},
    groups::FeatureScale{{0, 70, 120, 180, 250, 320, 400}, 230, 125},
    groups::FeatureScale{{0, 1.5, 3.5, 5.5, 7.5}, 4.4, 2.9}};

namespace {

using namespace groups;

std::vector<StatisticGroup> make_groups() {
  std::vector<StatisticGroup> groups;
  const auto add = [&](std::string name, std::string covariate, std::vector<std::string> labels) {
    const std::size_t first = groups.empty() ? 0 : groups.back().first + groups.back().size();
    groups.push_back({std::move(name), std::move(covariate), std::move(labels), first});
  };
  const auto each = [](const auto& values, const char* format) {
    std::vector<std::string> labels;
    for (const auto v : values) labels.push_back(fmt::format(fmt::runtime(format), v));
    return labels;
  };
  const auto counted = [](std::size_t n, const char* format) {
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < n; ++i) labels.push_back(fmt::format(fmt::runtime(format), i));
    return labels;
  };
  add("step", "history", each(kSteps_mm, "from {} mm in 10 s"));
  add("msd", "history", each(kLags_s, "root mean square displacement in {} s, mm"));
  add("step-by-wall", "position", each(kWalls_mm, "mean step from {} mm wall distance, mm"));
  add("occupancy", "position", counted(kRings, "ring {}"));
  add("step-by-time", "time", counted(kTimeBins, "mean step in 5 minutes {}, mm"));
  add("turn", "history", counted(kTurns, "eighth {} of 0..pi"));
  add("turn-bias", "robot", {"mean", "between robots", "in halves"});
  add("speed", "robot", {"mean", "between robots", "in halves"});
  add("still-in-the-open", "history", each(kOpenRuns, "episodes of {} blocks or more, in 1000"));
  add("still-beside-walls", "position", each(kWallRuns, "episodes of {} blocks or more, in 1000"));
  add("step-by-neighbours", "neighbours", counted(kNeighbours, "{} within 100 mm"));
  add("step-by-direction", "world_frame", counted(kSectors, "eighth {} of the compass"));
  add("step-by-place", "position", counted(kColumns * kRows, "place {}"));
  add("occupancy-of-the-rim", "position", counted(kBoundarySections, "part {}"));
  add("drift", "world_frame", {"x", "y"});
  add("reports", "measurement",
      {"blocks without reports", "report again after 2 s", "two reports at once", "same cell", "adjacent cell",
       "blocks without reports, between robots", "same polling advance", "blocks without any report",
       "no report after such a block"});
  add("stays-beside-walls", "position", each(kStays, "stays of {} blocks or more, in 1000"));
  add("middle-by-time", "time", counted(kMiddleBins, "share in the middle in 10 minutes {}"));
  add("extent", "robot", {"mean", "between robots", "in halves"});
  add("occupancy-along-x", "position", counted(kAcross, "tenth {}"));
  add("occupancy-along-y", "position", counted(kAcross, "tenth {}"));
  add("way-to-the-middle-along-x", "position", counted(kToMiddle, "in 100 s from fifth {}, of the middle, mm"));
  add("way-to-the-middle-along-y", "position", counted(kToMiddle, "in 100 s from fifth {}, of the middle, mm"));
  const std::array lasting_s = in_seconds(kLasting);
  add("speed-lasts", "history", each(lasting_s, "product of steps, lag {} s"));
  add("turning-lasts", "history", each(lasting_s, "product of turns, lag {} s"));
  const std::vector<std::string>& features = feature_names();
  for (std::size_t f = 0; f < kFeatures.size(); ++f)
    add("windows: " + features[f], "history", each(kFeatures[f].edges, "from {}"));
  std::vector<std::string> pairs;
  for (std::size_t f = 0; f < features.size(); ++f) {
    for (std::size_t g = 0; g < f; ++g) pairs.push_back(features[f] + " with " + features[g]);
  }
  add("windows: pairs", "history", std::move(pairs));
  return groups;
}

}  // namespace

const std::vector<StatisticGroup>& statistic_groups() {
  static const std::vector<StatisticGroup> groups = make_groups();
  return groups;
}

const StatisticGroup& statistic_group(std::string_view name) {
  const auto& groups = statistic_groups();
  return *std::find_if(groups.begin(), groups.end(), [&](const StatisticGroup& g) { return g.name == name; });
}

std::size_t statistic_count() { return statistic_groups().back().first + statistic_groups().back().size(); }

}  // namespace kilotwin::kilogrid
