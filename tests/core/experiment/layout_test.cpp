#include <chrono>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/base/state_hash.hpp"
#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class Layouts : public Scratch {
 protected:
  PlacedRobots placed(const std::string& layout, int count, const std::string& more = "") const {
    return place_robots(load("robots { behaviour: 'a.c' " + (count > 0 ? "count: " + std::to_string(count) : "") +
                             " layout { " + layout + " } }\n" + more));
  }
};

/// The smallest distance of two centres, found by testing all pairs.
double closest_mm(const PlacedRobots& robots) {
  double least = INFINITY;
  for (std::size_t i = 0; i < robots.x_mm.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      least = std::min(least, std::hypot(robots.x_mm[i] - robots.x_mm[j], robots.y_mm[i] - robots.y_mm[j]));
    }
  }
  return least;
}

TEST_F(Layouts, GridIsCentredAndFilledFromTheTopLeft) {
  const PlacedRobots grid =
      placed("x_mm: 100 y_mm: -50 grid { pitch_mm: 40 heading: HEADING_FIXED heading_deg: 270 }", 7);
  EXPECT_EQ(grid.x_mm, (std::vector<double>{60, 100, 140, 60, 100, 140, 60}));
  EXPECT_EQ(grid.y_mm, (std::vector<double>{-10, -10, -10, -50, -50, -50, -90}));
  for (const double heading : grid.heading_rad) EXPECT_DOUBLE_EQ(heading, -kPi / 2);
  const PlacedRobots row = placed("grid { pitch_mm: 50 columns: 9 }", 2);
  EXPECT_EQ(row.x_mm, (std::vector<double>{-25, 25}));
  EXPECT_EQ(row.y_mm, (std::vector<double>{0, 0}));
}

TEST_F(Layouts, AGridFromItsFirstRowHangsBelowTheOriginWithEachRowCentred) {
  const PlacedRobots grid = placed("x_mm: 100 y_mm: -50 grid { pitch_mm: 40 columns: 3 from_first_row: true }", 5);
  EXPECT_EQ(grid.x_mm, (std::vector<double>{60, 100, 140, 80, 120}));
  EXPECT_EQ(grid.y_mm, (std::vector<double>{-50, -50, -50, -90, -90}));
  const PlacedRobots row = placed("grid { pitch_mm: 50 columns: 9 from_first_row: true }", 2);
  EXPECT_EQ(row.x_mm, (std::vector<double>{-25, 25}));
}

TEST_F(Layouts, RandomHeadingsAreUniformAndDependOnTheSeed) {
  const PlacedRobots one = placed("grid { pitch_mm: 33 }", 2500);
  double sine = 0, cosine = 0;
  for (const double heading : one.heading_rad) {
    ASSERT_GE(heading, -kPi);
    ASSERT_LT(heading, kPi);
    sine += std::sin(heading);
    cosine += std::cos(heading);
  }
  // The resultant of n uniform headings is about sqrt(n) = 50 long.
  EXPECT_LT(std::hypot(sine, cosine), 200);
  EXPECT_EQ(one.heading_rad, placed("grid { pitch_mm: 33 }", 2500).heading_rad);
  EXPECT_NE(one.heading_rad, placed("grid { pitch_mm: 33 }", 2500, "seed: 2").heading_rad);
}

TEST_F(Layouts, RingsLookInwardsOrOutwards) {
  const PlacedRobots in = placed("x_mm: 10 rings { count: [1, 4] radius_mm: [0, 100] }", 0);
  const std::vector<double> x_mm{10, 110, 10, -90, 10}, y_mm{0, 0, 100, 0, -100};
  ASSERT_EQ(in.x_mm.size(), 5u);
  EXPECT_EQ(in.group_count, std::vector<std::uint32_t>{5});
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(in.x_mm[i], x_mm[i], 1e-12);
    EXPECT_NEAR(in.y_mm[i], y_mm[i], 1e-12);
  }
  EXPECT_NEAR(std::fabs(in.heading_rad[1]), kPi, 1e-12);
  EXPECT_NEAR(in.heading_rad[2], -kPi / 2, 1e-12);
  const PlacedRobots out = placed("rings { count: 4 radius_mm: 100 heading: HEADING_OUTWARDS }", 4);
  EXPECT_NEAR(out.heading_rad[1], kPi / 2, 1e-12);
}

TEST_F(Layouts, RandomKeepsItsGapAndItsRectangle) {
  const PlacedRobots robots = placed("x_mm: 300 random { width_mm: 800 height_mm: 600 min_gap_mm: 12 }", 130);
  EXPECT_GE(closest_mm(robots), 45);
  double mean_mm = 0;
  for (std::size_t i = 0; i < robots.x_mm.size(); ++i) {
    EXPECT_LE(std::fabs(robots.x_mm[i] - 300), 400 - 16.5);
    EXPECT_LE(std::fabs(robots.y_mm[i]), 300 - 16.5);
    mean_mm += robots.x_mm[i] / static_cast<double>(robots.x_mm.size());
  }
  // The standard error of the mean is 221 mm / sqrt(130) = 19 mm.
  EXPECT_NEAR(mean_mm, 300, 80);
  EXPECT_EQ(robots.x_mm, placed("x_mm: 300 random { width_mm: 800 height_mm: 600 min_gap_mm: 12 }", 130).x_mm);
}

TEST_F(Layouts, RandomKeepsClearOfOtherGroups) {
  const std::string groups =
      "robots { count: 100 behaviour: 'a.c' layout { random { width_mm: 700 height_mm: 700 } } }\n"
      "robots { count: 100 behaviour: 'a.c' layout { grid { } } }\n"
      "robots { count: 60 behaviour: 'a.c' layout { random { width_mm: 900 height_mm: 900 } } }\n";
  const PlacedRobots robots = place_robots(load(groups));
  EXPECT_GE(closest_mm(robots), 34);
  EXPECT_EQ(robots.group_count, (std::vector<std::uint32_t>{100, 100, 60}));
  EXPECT_EQ(robots.x_mm[100], -180);  // ids go by the order of groups, not of placement
}

TEST_F(Layouts, RandomReportsHowManyRobotsFit) {
  const std::string error = error_of([&] { placed("random { width_mm: 200 height_mm: 200 min_gap_mm: 5 }", 40); });
  int fitted = 0, read = 0;
  ASSERT_EQ(std::sscanf(error.c_str(), "e.txtpb:1:46: only %d of 40 robots fit at random with gaps of 5 mm;%n",
                        &fitted, &read),
            1)
      << error;
  EXPECT_GT(read, 0) << error;
  // Random packing of discs jams at a coverage of 0.547; the rim adds half a disc on each side.
  EXPECT_GE(fitted, 12);
  EXPECT_LE(fitted, 25);
}

TEST_F(Layouts, PosesInRadiansAndDegrees) {
  write("p.csv", "x_mm, y_mm, heading_rad\n1,2,4\n-100.5, 3e1 ,-1\n");
  const PlacedRobots radians = placed("x_mm: 10 poses { csv: 'p.csv' }", 0);
  EXPECT_EQ(radians.x_mm, (std::vector<double>{11, -90.5}));
  EXPECT_EQ(radians.y_mm, (std::vector<double>{2, 30}));
  EXPECT_DOUBLE_EQ(radians.heading_rad[0], 4 - 2 * kPi);
  EXPECT_DOUBLE_EQ(radians.heading_rad[1], -1);
  write("p.csv", "\xEF\xBB\xBFx_mm,y_mm,heading_deg\r\n0,0,540\r\n0,50,-90");
  const PlacedRobots degrees = placed("poses { csv: 'p.csv' }", 2);
  EXPECT_DOUBLE_EQ(degrees.heading_rad[0], -kPi);
  EXPECT_DOUBLE_EQ(degrees.heading_rad[1], -kPi / 2);
}

TEST_F(Layouts, CountsAreFilledIn) {
  const LoadedExperiment loaded = load(
      "robots { behaviour: 'a.c' layout { rings { count: [2, 6] radius_mm: [20, 70] } } }\n"
      "robots { count: 3 behaviour: 'a.c' layout { x_mm: 300 } }");
  const proto::Experiment experiment = with_counts(loaded, place_robots(loaded));
  EXPECT_EQ(experiment.robots(0).count(), 8u);
  EXPECT_EQ(experiment.robots(1).count(), 3u);
}

TEST_F(Layouts, PosesHaveTheSameBitsEverywhere) {
  const PlacedRobots robots = place_robots(
      load("seed: 42\nrobots { behaviour: 'a.c' layout { rings { count: [7, 19] radius_mm: [70, 150] } } }\n"
           "robots { count: 200 behaviour: 'a.c' layout { random { min_gap_mm: 4 } } }\n"
           "robots { count: 30 behaviour: 'a.c' layout { x_mm: 700 grid { heading: HEADING_INWARDS } } }\n"));
  std::uint64_t sum = 0;
  for (std::uint32_t i = 0; i < robots.x_mm.size(); ++i) {
    sum += entity_hash(HashDomain::kBody, i,
                       {hash_bits(robots.x_mm[i]), hash_bits(robots.y_mm[i]), hash_bits(robots.heading_rad[i])});
  }
  EXPECT_EQ(sum, 17803121658942113078u);
}

TEST_F(Layouts, TimeIsLinearInTheRobots) {
  // A crowd in a vast arena, half of it in one corner: a grid by the arena's mean density would take minutes.
  const auto start = std::chrono::steady_clock::now();
  const PlacedRobots robots = place_robots(
      load("arena { width_mm: 1e6 height_mm: 1e6 }\n"
           "robots { count: 50000 behaviour: 'a.c' layout { x_mm: -400000 y_mm: 400000 grid { pitch_mm: 33 } } }\n"
           "robots { count: 50000 behaviour: 'a.c' layout { random { width_mm: 12000 height_mm: 12000 } } }"));
  EXPECT_EQ(robots.x_mm.size(), 100'000u);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds{10});
}

}  // namespace
}  // namespace kilotwin::test
