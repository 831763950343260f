#include "clients/recorder/observables.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "core/stats/moments.hpp"
#include "tests/clients/recorder/synthetic.hpp"
#include "tests/clients/view/recordings.hpp"

namespace kilotwin::recorder {
namespace {

TEST(Observables, OfARecordingOfStraightMotion) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(3), 62);
  Reader reader(scratch / "r.ktrec");
  const ObservableCurves curves = observe(reader);
  ASSERT_EQ(curves.time_s.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    const double t = std::array{0.0, 31.0, 62.0}[k];
    EXPECT_DOUBLE_EQ(curves.time_s[k], t * 0.032768);
    // Robot i starts at (10 i, -5 i) and moves by (0.5 t, 0.25 i t); its heading is 0.1 i.
    stats::Moments square, distance;
    for (const double i : {0.0, 1.0, 2.0}) {
      square.add(t * t * (0.25 + 0.0625 * i * i));
      distance.add(t * std::hypot(0.5, 0.25 * i));
    }
    EXPECT_NEAR(curves.of(Observable::kMsd)[k], square.mean(), 1e-9);
    EXPECT_NEAR(curves.of(Observable::kDisplacement)[k], distance.mean(), 1e-9);
    const double up = 0.25 * t - 5;
    EXPECT_NEAR(curves.of(Observable::kSpread)[k], std::sqrt(2.0 / 3) * std::hypot(10, up), 1e-9);
    EXPECT_NEAR(curves.of(Observable::kNearest)[k], std::hypot(10, up), 1e-9);
    EXPECT_NEAR(curves.of(Observable::kPolarisation)[k], (1 + 2 * std::cos(0.1)) / 3, 1e-12);
  }
}

TEST(Observables, OfGroupsComeWithThoseOfAll) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(3);
  header.add_group_robots(2);
  header.add_group_robots(1);
  write_synthetic(scratch / "r.ktrec", header, 62);
  Reader reader(scratch / "r.ktrec"), again(scratch / "r.ktrec");
  const std::vector<ObservableCurves> observed = observe_with_groups(reader);
  ASSERT_EQ(observed.size(), 3u);
  EXPECT_EQ(observed[0].of(Observable::kSpread), observe(again).of(Observable::kSpread));
  EXPECT_NEAR(observed[1].of(Observable::kDisplacement)[2], 62 * (0.5 + std::hypot(0.5, 0.25)) / 2, 1e-9);
  EXPECT_NEAR(observed[2].of(Observable::kDisplacement)[2], 62 * std::hypot(0.5, 0.5), 1e-9);
}

TEST(Observables, OfSomeStatesAreThoseOfAllAtTheseStates) {
  const Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 12, .states = 30, .inside = true, .observables = true});
  Reader reader(scratch / "r.ktrec"), again(scratch / "r.ktrec");
  StateIndex index(scratch / "r.ktrec");
  ASSERT_TRUE(index.update());
  const ObservableCurves all = observe(reader), some = observe_every(again, index, 7);
  // States 0, 7, 14, 21, 28, and the last one.
  ASSERT_EQ(some.time_s.size(), 6u);
  ASSERT_EQ(some.own.size(), 2u);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t at = std::min<std::size_t>(7 * i, 29);
    EXPECT_EQ(some.time_s[i], all.time_s[at]);
    EXPECT_EQ(some.of(Observable::kNearest)[i], all.of(Observable::kNearest)[at]);
    for (std::size_t own = 0; own < 2; ++own)
      EXPECT_EQ(some.own[own].value[i], all.own[own].value[at]) << all.own[own].name << " " << at;
  }
}

TEST(Observables, PolarisationIsOneForACommonDirectionAndZeroForNone) {
  const std::vector<double> at{0, 100, 200, 300}, alike(4, 2.5),
      crossed{0.3, 0.3 + 1.5707963267948966, 0.3 + 3.141592653589793, 0.3 - 1.5707963267948966};
  ObservableObserver observer;
  observer.add(0, at, at, alike);
  observer.add(1, at, at, crossed);
  EXPECT_NEAR(observer.curves().of(Observable::kPolarisation)[0], 1, 1e-12);
  EXPECT_NEAR(observer.curves().of(Observable::kPolarisation)[1], 0, 1e-12);
}

TEST(Observables, PushedIsTheDisplacementOfMovableBodies) {
  const std::vector<double> robot{0};
  ObservableObserver with, without;
  with.add(0, robot, robot, robot, std::array{1.0, 5.0}, std::array{2.0, 5.0});
  with.add(1, robot, robot, robot, std::array{4.0, 5.0}, std::array{6.0, 6.0});
  EXPECT_EQ(with.curves().of(Observable::kPushed)[0], 0);
  EXPECT_DOUBLE_EQ(with.curves().of(Observable::kPushed)[1], 3);
  without.add(0, robot, robot, robot);
  EXPECT_TRUE(std::isnan(without.curves().of(Observable::kPushed)[0]));
}

TEST(Observables, NearestIsUndefinedForASingleRobot) {
  EXPECT_TRUE(std::isnan(mean_nearest_distance_mm(std::array{1.0}, std::array{2.0})));
}

TEST(Observables, NearestDistanceIsThatOfComparingAllPairs) {
  std::mt19937 generator(7);
  struct Field {
    double width_mm, height_mm;
    int robots;
  };
  for (const Field field : {Field{1000, 1000, 300},
                            {1000, 0, 100},
                            {0, 1000, 100},
                            {0, 0, 5},
                            {1e5, 10, 200},
                            {10, 1e5, 200},
                            {500, 500, 2}}) {
    std::vector<double> x, y;
    for (int i = 0; i < field.robots; ++i) {
      x.push_back(field.width_mm * (static_cast<double>(generator() % 1000) / 1000 - 0.5));
      y.push_back(field.height_mm * (static_cast<double>(generator() % 1000) / 1000 - 0.5));
    }
    stats::Moments expected;
    for (std::size_t i = 0; i < x.size(); ++i) {
      double best = INFINITY;
      for (std::size_t j = 0; j < x.size(); ++j) {
        if (j != i) best = std::min(best, std::hypot(x[j] - x[i], y[j] - y[i]));
      }
      expected.add(best);
    }
    EXPECT_NEAR(mean_nearest_distance_mm(x, y), expected.mean(), 1e-9)
        << field.width_mm << " x " << field.height_mm;
  }
}

}  // namespace
}  // namespace kilotwin::recorder
