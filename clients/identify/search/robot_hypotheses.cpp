#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

}  // namespace

void add_robot_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  constexpr std::size_t kMost = 120;  // robots; with more, no hypothesis has a column for each of them
  if (extent.robots.size() < 2 || extent.robots.size() > kMost) return;
  std::vector<double> keys(extent.robots.begin(), extent.robots.end());
  const auto n = static_cast<Eigen::Index>(keys.size());
  const auto gains = make.put(kSpeed, Basis{{keyed(Shape::kTable, Covariate::kRobot, keys)}});
  make.add(kSpeed, "robot", {"robot"}, some(gains, 0, n));
  // Robots; with more, only the gains above are tried. A larger value costs a column per robot in each of the hypotheses below.
  constexpr std::size_t kMostForAll = 40;
  if (keys.size() > kMostForAll) return;
  // Robots that tire; robots whose bias changes or that are replaced.
  const Basis slopes{{keyed(Shape::kTable, Covariate::kRobot, keys),
                      over(Shape::kLinear, Covariate::kTime, 0, extent.duration_s, 1)}};
  for (const TargetGroup* group : {&kSpeed, &kTurning})
    make.add(*group, "robot-and-time", {"robot", "time"}, some(make.put(*group, slopes), 0, n));
  // A bent leg, a rotated marker.
  const Basis each{{keyed(Shape::kTable, Covariate::kRobot, keys)}};
  make.add(kSlip, "robot", {"robot"}, some(make.put(kSlip, each), 0, n));
  make.add(kWorld, "robot", {"robot"}, some(make.put(kWorld, each), 0, n));
  if (extent.headings) make.add(kCompass, "robot", {"robot"}, some(make.put(kCompass, each), 0, n));
  const auto ahead = make.put(Target::kMeasuredAhead, each, kAlways),
             left = make.put(Target::kMeasuredLeft, each, kAlways);
  make.add("camera-by-robot", {"measurement", "robot"}, kCamera.in_words, some({ahead, left}, 0, n));
}

void add_run_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  constexpr std::size_t kMost = 40;  // runs; with more, no hypothesis has a column for each of them
  if (extent.runs.size() < 2 || extent.runs.size() > kMost) return;
  const Basis which{{keyed(Shape::kTable, Covariate::kRun, {extent.runs.begin(), extent.runs.end()})}};
  const auto n = static_cast<Eigen::Index>(extent.runs.size());
  const auto scale = make.put(Target::kMeasuredScale, which);
  make.add("camera-by-run", {"measurement"}, kCamera.in_words, some({scale}, 0, n));
  // Speed of a run, as an alternative to the camera scale: turns separate the two.
  make.add(kSpeed, "run", {"history"}, some(make.put(kSpeed, which), 0, n));
  if (extent.headings) make.add(kCompass, "run", {}, some(make.put(kCompass, which), 0, n));
}

}  // namespace kilotwin::identify
