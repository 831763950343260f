#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

}  // namespace

void add_neighbour_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  if (!extent.neighbours) return;
  // Radii 70, 100 and 150 mm. The shape refinement fits the radius.
  constexpr std::uint8_t kSought[] = {3, 6, 11};
  const auto with_radius = [](Factor f, std::uint8_t radius) {
    f.axis.radius = radius;
    return f;
  };
  for (const std::uint8_t r : kSought) {
    const double reach = kNeighbourRadii_mm[r];
    const Factor near = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, reach, 3), r);
    const auto bases = make.put(kSpeed, Basis{{near}});
    for (const Eigen::Index n : {1, 3}) make.add(kSpeed, "neighbours", {"neighbours"}, some(bases, 0, n), 6);
    const Factor falling = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, reach, 2), r);
    const Factor bearing = with_radius(over(Shape::kHarmonics, Covariate::kBearing, 0, 1, 1), r);
    for (const TargetGroup* group : {&kTurning, &kSlip}) {
      const auto aside = make.put(*group, Basis{{falling, bearing}});
      make.add(*group, "neighbours", {"neighbours"}, {aside[0] + 1}, 6);
      make.add(*group, "neighbours", {"neighbours"}, {aside[0] + 1, aside[0] + 3}, 6);
    }
    const auto forward = make.put(Target::kAhead, Basis{{falling, bearing}});
    make.add("speed-by-neighbours", {"neighbours"}, kSpeed.in_words, {forward, forward + 2}, 6);
  }
  // For any direction of the nearest.
  const Factor close = with_radius(over(Shape::kTaper, Covariate::kNearest, 0, kNeighbourRadii_mm[6], 2), 6);
  const auto spun = make.put(kTurning, Basis{{close}});
  make.add(kTurning, "neighbours", {"neighbours"}, some(spun, 0, 2), 6);
  make.add(kWorld, "neighbours", {"neighbours"}, some(make.put(kWorld, Basis{{close}}), 0, 2));
  for (const std::uint8_t r : kSought) {
    const Factor count = with_radius(over(Shape::kCosines, Covariate::kNeighbours, 0, 8, 3), r);
    const auto bases = make.put(kSpeed, Basis{{count}});
    for (const Eigen::Index n : {1, 3}) make.add(kSpeed, "neighbours", {"neighbours"}, some(bases, 0, n), 8);
    const Factor density = with_radius(over(Shape::kCosines, Covariate::kDensity, 0, 4, 3), r);
    const auto dense = make.put(kSpeed, Basis{{density}});
    for (const Eigen::Index n : {1, 3}) make.add(kSpeed, "neighbours", {"neighbours"}, some(dense, 0, n), 8);
  }
}

void add_traffic_hypotheses(DictionaryBuilder& make) {
  for (std::uint8_t cells = 0; cells < kTrafficGrids; ++cells) {
    // Without a trail there is no effect.
    Factor f = MotionModel{}.cells[cells].trail ? keyed(Shape::kLevelling, Covariate::kTraffic, {0.1, 0.4, 2})
                                                : keyed(Shape::kExponential, Covariate::kTraffic, {2, 8, 32});
    f.axis.radius = cells;
    const auto bases = make.put(kSpeed, Basis{{f}});
    make.add(kSpeed, "traffic", {"history", "position"}, some(bases, 0, 3), kTrafficGrids);
  }
}

}  // namespace kilotwin::identify
