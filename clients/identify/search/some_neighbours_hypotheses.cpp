#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Indices in kNeighbourRadii_mm of 70, 100 and 150 mm. The shape refinement fits the radius.
constexpr std::array<std::uint8_t, 3> kSoughtRadii = {3, 6, 11};

Axis neighbours_axis(Covariate of, std::uint8_t radius, Others others) {
  Axis axis{of, radius};
  axis.others = others;
  return axis;
}

/// Neighbours that drive, or those at rest.
void add_by_command(DictionaryBuilder& make) {
  // Forms to choose from, as the price in log evidence; a larger value finds such effects later.
  constexpr double kChoices = 12;
  for (const Others others : {Others::kDriven, Others::kResting}) {
    for (const std::uint8_t r : kSoughtRadii) {
      Factor count = over(Shape::kCosines, Covariate::kNeighbours, 0, 8, 3);
      count.axis = neighbours_axis(Covariate::kNeighbours, r, others);
      const auto bases = make.put(kSpeed, Basis{{count}});
      for (const Eigen::Index n : {1, 3})
        make.add(kSpeed, "neighbours", {"neighbours"}, some(bases, 0, n), kChoices);
    }
    // Turns away from the nearest, or towards it.
    constexpr std::uint8_t kRadius = 6;
    Factor falling = over(Shape::kTaper, Covariate::kNearest, 0, kNeighbourRadii_mm[kRadius], 2),
           bearing = over(Shape::kHarmonics, Covariate::kBearing, 0, 1, 1);
    falling.axis = neighbours_axis(Covariate::kNearest, kRadius, others);
    bearing.axis = neighbours_axis(Covariate::kBearing, kRadius, others);
    const auto turning = make.put(kTurning, Basis{{falling, bearing}});
    make.add(kTurning, "neighbours", {"neighbours"}, {turning[0] + 1, turning[0] + 3}, kChoices);
  }
}

/// One robot within a radius of the others: a leader, or a robot with another coating. Or each robot by itself.
void add_by_robot(DictionaryBuilder& make, const Extent& extent) {
  constexpr std::size_t kMost = 40;  // robots; with more, no robot gets a column of its own
  const std::size_t robots = extent.robots.size();
  if (robots < 3 || robots > kMost) return;
  constexpr std::array<std::uint8_t, 2> kRadii = {6, 11};  // indices in kNeighbourRadii_mm: 100 and 150 mm
  for (const std::uint8_t r : kRadii) {
    std::vector<Eigen::Index> all;
    for (const std::uint32_t robot : extent.robots) {
      Factor near = keyed(Shape::kAtLeast, Covariate::kNeighbours, {1});
      near.axis.radius = r;
      near.axis.only_robot = robot + 1;
      for (const Eigen::Index column : make.put(kSpeed, Basis{{near}})) {
        make.add(kSpeed, "robot-nearby", {"neighbours", "robot"}, {column},
                 static_cast<double>(kRadii.size() * robots));
        all.push_back(column);
      }
    }
    make.add(kSpeed, "robot-nearby", {"neighbours", "robot"}, all, static_cast<double>(kRadii.size()));
  }
}

}  // namespace

void add_some_neighbours_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  if (!extent.neighbours) return;
  if (extent.has_stop) add_by_command(make);
  add_by_robot(make, extent);
}

}  // namespace kilotwin::identify
