#include <algorithm>
#include <utility>

#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// A covariate of a general term: its word, and a basis with few columns that includes or lacks a constant.
struct Part {
  const char* word;
  Factor factor;
};

Part time_part(const Extent& e, std::uint32_t count) {
  Factor f = over(Shape::kCosines, Covariate::kTime, 0, e.duration_s, count);
  f.first = 0;
  return {"time", f};
}
Part since_part(const Extent& e, std::uint32_t count) {
  Factor f = over(Shape::kCosines, Covariate::kSinceCommand, 0, e.since_s, count);
  f.first = 0;
  f.warp = 1;
  return {"time_since_command", f};
}
Part motor_part(const Extent& e, std::uint32_t count) {
  Factor f = over(Shape::kCosines, Covariate::kDrivenTime, 0, e.driven_s, count);
  f.first = 0;
  return {"motor_time", f};
}
Part heading_part(std::uint32_t harmonics) {
  return {"heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, harmonics)};
}
Part place_part(const Extent& e, std::uint32_t order) { return {"position", plane(e, order)}; }
Part command_part(const Extent& e) {
  std::vector<double> moving;
  if (e.has_straight) moving.push_back(1);
  if (e.has_turns) moving.insert(moving.end(), {2, 3});
  return {"command", keyed(Shape::kTable, Covariate::kCommand, moving)};
}
/// The command before the present one.
Part previous_part(const Extent& e) {
  std::vector<double> before{kNoCommand};
  if (e.has_stop) before.push_back(0);
  if (e.has_straight) before.push_back(1);
  if (e.has_turns) before.insert(before.end(), {2, 3});
  return {"history", keyed(Shape::kTable, Covariate::kPreviousCommand, before)};
}
Part robot_part(const Extent& e) {
  return {"robot", keyed(Shape::kTable, Covariate::kRobot, {e.robots.begin(), e.robots.end()})};
}
/// Distance of the nearest robot, up to 150 mm.
Part nearest_part(std::uint32_t count) {
  constexpr std::uint8_t kRadius = 11;  // index in kNeighbourRadii_mm
  Factor f = over(Shape::kTaper, Covariate::kNearest, 0, kNeighbourRadii_mm[kRadius], count);
  f.axis.radius = kRadius;
  return {"neighbours", f};
}

/// A term over two covariates. With too many columns, as with many robots, it is left out.
void add_pair(DictionaryBuilder& make, const TargetGroup& group, const Part& first, const Part& second) {
  const Basis basis{{first.factor, second.factor}};
  if (basis.size() == 0 || basis.size() > kMostColumns) return;
  std::string of = std::string(first.word) + "-and-" + second.word;
  std::replace(of.begin(), of.end(), '_', '-');
  make.add(group, of, {first.word, second.word},
           some(make.put(group, basis), 0, static_cast<Eigen::Index>(basis.size())));
}

/// Maps that change with time: products of plane waves up to an order and cosines over time.
void add_changing_maps(DictionaryBuilder& make, const Extent& extent, const TargetGroup& group, std::uint32_t order,
                       std::uint32_t times, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& sizes) {
  const auto of_map = [](std::uint32_t o) { return static_cast<Eigen::Index>((o + 1) * (o + 2) / 2); };
  Factor map = plane(extent, order);
  map.first = 0;
  const auto across = of_map(order);
  const auto each = static_cast<std::uint32_t>(static_cast<Eigen::Index>(kMostColumns) / across);
  std::vector<std::vector<Eigen::Index>> bases;
  for (std::uint32_t first = 0; first < times; first += each) {
    Factor time = over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, std::min(each, times - first));
    time.first = first;
    bases.push_back(make.put(group, Basis{{time, map}}));
  }
  for (const auto& [most_times, most_order] : sizes) {
    std::vector<Eigen::Index> columns;
    for (std::uint32_t t = 0; t < std::min(most_times, times); ++t)
      for (const Eigen::Index base : bases[t / each])
        for (Eigen::Index i = 0; i < of_map(most_order); ++i)
          columns.push_back(base + static_cast<Eigen::Index>(t % each) * across + i);
    make.add(group, "position-and-time", {"position", "time"}, columns);
  }
}

void add_maps_over_time(DictionaryBuilder& make, const Extent& extent) {
  add_changing_maps(make, extent, kSpeed, 7, 12, {{3, 3}, {6, 5}, {12, 7}});
}

void add_drifts_over_time(DictionaryBuilder& make, const Extent& extent) {
  add_changing_maps(make, extent, kWorld, 4, 8, {{3, 2}, {5, 3}, {8, 4}});
  add_changing_maps(make, extent, kTurning, 3, 6, {{3, 2}, {6, 3}});
}

void add_pairs_with_robots(DictionaryBuilder& make, const Extent& extent) {
  if (extent.robots.size() < 2) return;
  const Part robot = robot_part(extent);
  for (const TargetGroup* group : {&kSpeed, &kTurning}) {
    add_pair(make, *group, robot, time_part(extent, 6));
    add_pair(make, *group, robot, place_part(extent, 2));
    if (extent.has_straight && extent.has_turns) add_pair(make, *group, robot, command_part(extent));
  }
  add_pair(make, kSpeed, robot, heading_part(2));
  add_pair(make, kSpeed, robot, since_part(extent, 3));
  if (extent.neighbours) add_pair(make, kSpeed, robot, nearest_part(2));
  if (extent.headings) add_pair(make, kCompass, robot, time_part(extent, 6));
}

/// A course of each run over time: temperature, batteries, light of the day.
void add_courses_of_runs(DictionaryBuilder& make, const Extent& extent) {
  if (extent.runs.size() < 2) return;
  const Factor which = keyed(Shape::kTable, Covariate::kRun, {extent.runs.begin(), extent.runs.end()});
  for (const TargetGroup* group : {&kSpeed, &kTurning}) {
    const Basis basis{{which, time_part(extent, 6).factor}};
    if (basis.size() > kMostColumns) continue;
    make.add(*group, "run-and-time", {"history", "time"},
             some(make.put(*group, basis), 0, static_cast<Eigen::Index>(basis.size())));
  }
}

void add_other_pairs(DictionaryBuilder& make, const Extent& extent) {
  const bool commands = extent.has_straight && extent.has_turns;
  for (const TargetGroup* group : {&kSpeed, &kTurning}) {
    std::vector<Part> parts{time_part(extent, 6), place_part(extent, 3), heading_part(2), since_part(extent, 4)};
    if (extent.has_stop) parts.push_back(motor_part(extent, 5));
    if (commands) parts.insert(parts.end(), {command_part(extent), previous_part(extent)});
    for (std::size_t i = 0; i < parts.size(); ++i)
      for (std::size_t j = i + 1; j < parts.size(); ++j)
        // Maps over time have a family of their own.
        if (!(i == 0 && j == 1)) add_pair(make, *group, parts[i], parts[j]);
  }
  if (commands) add_pair(make, kSlip, command_part(extent), heading_part(2));
  add_pair(make, kSlip, place_part(extent, 3), heading_part(2));
  if (extent.headings) add_pair(make, kCompass, place_part(extent, 3), heading_part(2));
}

/// Drifts and slips beside those over place and time.
void add_pairs_of_drifts(DictionaryBuilder& make, const Extent& extent) {
  const bool commands = extent.has_straight && extent.has_turns;
  for (const TargetGroup* group : {&kWorld, &kSlip}) {
    std::vector<Part> parts{time_part(extent, 4), place_part(extent, 2), since_part(extent, 3)};
    if (extent.has_stop) parts.push_back(motor_part(extent, 3));
    if (commands) parts.insert(parts.end(), {command_part(extent), previous_part(extent)});
    if (extent.neighbours) parts.push_back(nearest_part(2));
    for (std::size_t i = 0; i < parts.size(); ++i)
      for (std::size_t j = i + 1; j < parts.size(); ++j)
        if (group == &kSlip || !(i == 0 && j == 1)) add_pair(make, *group, parts[i], parts[j]);
  }
  if (extent.robots.size() < 2) return;
  add_pair(make, kSlip, robot_part(extent), time_part(extent, 2));
  if (commands) add_pair(make, kSlip, robot_part(extent), command_part(extent));
}

/// Errors of the camera about single robots, as about their markers, and about places.
void add_pairs_of_sight(DictionaryBuilder& make, const Extent& extent) {
  add_pair(make, kCamera, place_part(extent, 2), heading_part(2));
  add_pair(make, kCamera, place_part(extent, 3), time_part(extent, 4));
  if (extent.robots.size() >= 2) add_pair(make, kCamera, robot_part(extent), heading_part(2));
}

void add_pairs_with_neighbours(DictionaryBuilder& make, const Extent& extent) {
  if (!extent.neighbours) return;
  Factor around = over(Shape::kHarmonics, Covariate::kBearing, 0, 1, 3);
  around.axis.radius = nearest_part(1).factor.axis.radius;
  const Part bearing{"neighbours", around};
  for (const TargetGroup* group : {&kSpeed, &kTurning, &kSlip}) {
    const Basis basis{{nearest_part(4).factor, around}};
    make.add(*group, "neighbours", {"neighbours"},
             some(make.put(*group, basis), 0, static_cast<Eigen::Index>(basis.size())));
  }
  for (const TargetGroup* group : {&kSpeed, &kTurning}) {
    add_pair(make, *group, nearest_part(3), time_part(extent, 5));
    add_pair(make, *group, nearest_part(3), place_part(extent, 3));
    add_pair(make, *group, nearest_part(3), heading_part(2));
    add_pair(make, *group, nearest_part(3), since_part(extent, 4));
    if (extent.has_straight && extent.has_turns) add_pair(make, *group, nearest_part(3), command_part(extent));
  }
}

}  // namespace

std::vector<Dictionary> general_dictionaries_of(const Extent& extent) {
  std::vector<Dictionary> all;
  for (const auto add : {add_maps_over_time, add_drifts_over_time, add_pairs_with_robots, add_courses_of_runs,
                         add_other_pairs, add_pairs_of_drifts, add_pairs_of_sight, add_pairs_with_neighbours}) {
    Dictionary dictionary;
    DictionaryBuilder make(dictionary);
    add(make, extent);
    make.finish();
    if (!dictionary.hypotheses.empty()) all.push_back(std::move(dictionary));
  }
  return all;
}

}  // namespace kilotwin::identify
