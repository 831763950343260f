#include "core/plan/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

struct GridCase {
  double width_mm, height_mm;
  std::uint32_t columns, rows;
};

void PrintTo(const GridCase& grid, std::ostream* out) {
  *out << grid.columns << "x" << grid.rows << " of " << grid.width_mm << " mm x " << grid.height_mm << " mm";
}

std::string name_of(const testing::TestParamInfo<GridCase>& info) {
  return std::to_string(info.param.columns) + "x" + std::to_string(info.param.rows) + "_" +
         std::to_string(info.index);
}

class Grids : public testing::TestWithParam<GridCase> {
 protected:
  PartitionGrid grid_{GetParam().width_mm, GetParam().height_mm, GetParam().columns, GetParam().rows};

  /// Checks that only the owner's rectangle contains the point.
  void expect_one_owner(double x_mm, double y_mm) const {
    const PartitionId owner = grid_.owner(x_mm, y_mm);
    for (std::uint32_t p = 0; p < grid_.size(); ++p) {
      ASSERT_EQ(grid_.rectangle(PartitionId{p}).contains(x_mm, y_mm), PartitionId{p} == owner)
          << "partition " << p << " at " << x_mm << ", " << y_mm;
    }
  }
};

TEST_P(Grids, EveryPlaceHasOneOwner) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> x(-0.7 * GetParam().width_mm, 0.7 * GetParam().width_mm);
  std::uniform_real_distribution<double> y(-0.7 * GetParam().height_mm, 0.7 * GetParam().height_mm);
  for (int i = 0; i < 2000; ++i) expect_one_owner(x(random), y(random));
  for (const double far_x : {-1e300, -0.0, 0.0, 1e300}) {
    for (const double far_y : {-1e300, -0.0, 0.0, 1e300}) expect_one_owner(far_x, far_y);
  }
}

TEST_P(Grids, EdgesBelongToTheRightAndUpperPartition) {
  for (std::uint32_t p = 0; p < grid_.size(); ++p) {
    const Rectangle& r = grid_.rectangle(PartitionId{p});
    const double x_mm = std::isinf(r.x_min_mm) ? -GetParam().width_mm / 2 : r.x_min_mm;
    const double y_mm = std::isinf(r.y_min_mm) ? -GetParam().height_mm / 2 : r.y_min_mm;
    EXPECT_EQ(grid_.owner(x_mm, y_mm), PartitionId{p});
    for (const double dx : {std::nextafter(x_mm, -kInf), x_mm, std::nextafter(x_mm, kInf)}) {
      for (const double dy : {std::nextafter(y_mm, -kInf), y_mm, std::nextafter(y_mm, kInf)})
        expect_one_owner(dx, dy);
    }
    if (!std::isinf(r.x_min_mm)) {
      EXPECT_EQ(grid_.owner(std::nextafter(x_mm, -kInf), y_mm), PartitionId{p - 1});
    }
    if (!std::isinf(r.y_min_mm)) {
      EXPECT_EQ(grid_.owner(x_mm, std::nextafter(y_mm, -kInf)), PartitionId{p - grid_.columns()});
    }
  }
}

TEST_P(Grids, CellsAreEqualAndOutermostEdgesInfinite) {
  const double cell_mm = GetParam().width_mm / GetParam().columns;
  for (std::uint32_t p = 0; p < grid_.size(); ++p) {
    const Rectangle& r = grid_.rectangle(PartitionId{p});
    const std::uint32_t column = p % grid_.columns(), row = p / grid_.columns();
    EXPECT_EQ(r.x_min_mm == -kInf, column == 0);
    EXPECT_EQ(r.x_max_mm == kInf, column + 1 == grid_.columns());
    EXPECT_EQ(r.y_min_mm == -kInf, row == 0);
    EXPECT_EQ(r.y_max_mm == kInf, row + 1 == grid_.rows());
    if (column > 0 && column + 1 < grid_.columns()) {
      EXPECT_NEAR(r.x_max_mm - r.x_min_mm, cell_mm, 1e-9 * GetParam().width_mm);
    }
  }
}

TEST_P(Grids, NeighboursAreMutualAscendingAndWithinTheMargin) {
  for (const double margin_mm : {0.0, 33.0, 100.0, 1e9}) {
    for (std::uint32_t p = 0; p < grid_.size(); ++p) {
      std::set<std::uint32_t> expected;
      for (std::uint32_t q = 0; q < grid_.size(); ++q) {
        const double gap_mm = grid_.rectangle(PartitionId{p}).distance_mm(grid_.rectangle(PartitionId{q}));
        EXPECT_EQ(gap_mm, grid_.rectangle(PartitionId{q}).distance_mm(grid_.rectangle(PartitionId{p})));
        if (q != p && gap_mm <= margin_mm) expected.insert(q);
      }
      std::vector<std::uint32_t> found;
      for (const PartitionId q : grid_.neighbours(PartitionId{p}, margin_mm)) found.push_back(q.value());
      EXPECT_EQ(found, std::vector<std::uint32_t>(expected.begin(), expected.end()));
      if (margin_mm >= 1e9) {
        EXPECT_EQ(found.size(), grid_.size() - 1);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Grids,
                         testing::Values(GridCase{2000, 2000, 1, 1}, GridCase{2000, 1000, 2, 1},
                                         GridCase{1000, 2000, 1, 3}, GridCase{1999.7, 733.1, 7, 3},
                                         GridCase{1e6, 40, 64, 1}, GridCase{0.3, 0.7, 10, 9},
                                         GridCase{2400, 1600, 12, 8}),
                         name_of);

TEST(PartitionGrid, NumbersRunByRowsFromTheBottom) {
  const PartitionGrid grid(2000, 1000, 2, 2);
  EXPECT_EQ(grid.owner(-1, -1), PartitionId{0});
  EXPECT_EQ(grid.owner(0, -1), PartitionId{1});
  EXPECT_EQ(grid.owner(-1, 0), PartitionId{2});
  EXPECT_EQ(grid.owner(0, 0), PartitionId{3});
  EXPECT_EQ(grid.owner(-kInf, kInf), PartitionId{2});
}

TEST(PartitionGrid, DiagonalNeighboursTouch) {
  const PartitionGrid grid(900, 900, 3, 3);
  EXPECT_EQ(grid.neighbours(PartitionId{4}, 0).size(), 8u);
  EXPECT_EQ(grid.neighbours(PartitionId{0}, 0),
            (std::vector<PartitionId>{PartitionId{1}, PartitionId{3}, PartitionId{4}}));
  EXPECT_EQ(grid.neighbours(PartitionId{0}, 299.9).size(), 3u);
  EXPECT_EQ(grid.neighbours(PartitionId{0}, 300).size(), 7u);  // The far corner is 300 sqrt 2 away.
  EXPECT_EQ(grid.neighbours(PartitionId{0}, 425).size(), 8u);
}

TEST(PartitionGridDeathTest, NoOwnerOfANan) {
  const PartitionGrid grid(900, 900, 3, 3);
  EXPECT_DEATH(static_cast<void>(grid.owner(std::nan(""), 0)), "expected");
}

TEST(Rectangle, Distances) {
  const Rectangle r{0, 0, 10, 5};
  EXPECT_EQ(r.distance_mm(3, 3), 0);
  EXPECT_EQ(r.distance_mm(10, 5), 0);
  EXPECT_EQ(r.distance_mm(-2, 3), 2);
  EXPECT_EQ(r.distance_mm(13, 9), 5);
  EXPECT_EQ(r.distance_mm(Rectangle{10, 0, 20, 5}), 0);
  EXPECT_EQ(r.distance_mm(Rectangle{13, 9, 20, 20}), 5);
  EXPECT_EQ(r.distance_mm(Rectangle{-kInf, 7, kInf, kInf}), 2);
  EXPECT_EQ((Rectangle{-kInf, -kInf, 0, 0}.distance_mm(3, 4)), 5);
}

/// Groups of 5, 3 and 9 robots; the second is tracked.
proto::Manifest some_manifest() {
  proto::Manifest manifest;
  manifest.set_run(77);
  proto::Experiment& experiment = *manifest.mutable_experiment();
  experiment.set_duration_s(10);
  experiment.set_seed(9);
  experiment.mutable_arena()->set_width_mm(1000);
  experiment.mutable_deployment()->set_partition_columns(3);
  experiment.mutable_deployment()->set_partition_rows(2);
  experiment.mutable_deployment()->set_hosts(4);
  for (const std::uint32_t count : {5u, 3u, 9u}) experiment.add_robots()->set_count(count);
  experiment.mutable_robots(1)->set_body(proto::RobotGroup::TRACKED);
  manifest.add_program()->set_path("a.c");
  manifest.add_program()->set_path("b.c");
  for (const std::uint32_t program : {1u, kNoProgram, 0u}) manifest.add_group_program(program);
  for (int robot = 0; robot < 17; ++robot) {
    manifest.add_x_mm(robot);
    manifest.add_y_mm(-robot);
    manifest.add_heading_rad(robot * 0.125);
  }
  return manifest;
}

TEST(RunPlan, ReturnsTheValuesOfTheManifest) {
  const RunPlan plan(some_manifest());
  EXPECT_EQ(plan.run(), 77u);
  EXPECT_EQ(plan.seed(), 9u);
  EXPECT_EQ(plan.robots(), 17u);
  EXPECT_EQ(plan.tick_length.cycles(), 1u << 18);
  EXPECT_EQ(plan.last_tick, Tick{306});  // 305.2 ticks
  EXPECT_EQ(plan.grid.size(), 6u);
  EXPECT_EQ(plan.hosts, 4u);
  EXPECT_EQ(plan.initial_pose(4).x_mm, 4);
  EXPECT_EQ(plan.initial_pose(4).y_mm, -4);
  EXPECT_EQ(plan.initial_pose(4).heading_rad, 0.5);
  for (std::uint32_t robot = 0; robot < 17; ++robot) {
    EXPECT_EQ(plan.program_of(robot), robot < 5 ? 1 : robot < 8 ? kNoProgram : 0);
    EXPECT_EQ(plan.tracked(robot), robot >= 5 && robot < 8);
  }
}

TEST(RunPlan, NamesOfFederates) {
  const RunPlan plan(some_manifest());
  ASSERT_EQ(plan.federates(), 12u);
  EXPECT_EQ(plan.name(plan.physics(PartitionId{0})), "physics 0,0");
  EXPECT_EQ(plan.name(plan.physics(PartitionId{5})), "physics 2,1");
  EXPECT_EQ(plan.name(plan.radio()), "radio");
  EXPECT_EQ(plan.name(plan.station()), "station");
  EXPECT_EQ(plan.name(plan.behaviours(HostId{0})), "behaviours 1/4");
  EXPECT_EQ(plan.name(plan.behaviours(HostId{3})), "behaviours 4/4");
  std::set<std::string> names;
  for (std::uint32_t id = 0; id < plan.federates(); ++id) names.insert(plan.name(FederateId{id}));
  EXPECT_EQ(names.size(), 12u);
}

TEST(RunPlan, SharesCoverTheRobotsWithoutGapAndHostOfAgrees) {
  for (const std::uint32_t robots : {1u, 2u, 3u, 17u, 64u, 65u, 1000u, 9973u}) {
    for (const std::uint32_t hosts : {1u, 2u, 3u, 7u, 63u, 64u}) {
      proto::Manifest manifest = some_manifest();
      manifest.mutable_experiment()->clear_robots();
      manifest.mutable_experiment()->add_robots()->set_count(robots);
      manifest.mutable_experiment()->mutable_deployment()->set_hosts(hosts);
      manifest.clear_group_program();
      manifest.add_group_program(0);
      for (auto* field : {manifest.mutable_x_mm(), manifest.mutable_y_mm(), manifest.mutable_heading_rad()}) {
        field->Clear();
        field->Resize(static_cast<int>(robots), 0.0);
      }
      const RunPlan plan(std::move(manifest));
      std::uint32_t next = 0;
      for (std::uint32_t host = 0; host < hosts; ++host) {
        const Share share = plan.share(HostId{host});
        ASSERT_EQ(share.first, next);
        ASSERT_GE(share.size(), robots / hosts);
        ASSERT_LE(share.size(), robots / hosts + 1);
        for (std::uint32_t robot = share.first; robot < share.last; ++robot) {
          ASSERT_EQ(plan.host_of(robot), HostId{host});
          ASSERT_TRUE(share.contains(robot));
        }
        EXPECT_FALSE(share.contains(share.last));
        next = share.last;
      }
      ASSERT_EQ(next, robots);
    }
  }
}

TEST(RunPlan, HashCoversAllFieldsExceptTheMode) {
  const std::uint64_t base = RunPlan(some_manifest()).hash;
  EXPECT_EQ(RunPlan(some_manifest()).hash, base);

  proto::Manifest manifest = some_manifest();
  manifest.set_mode("local");
  EXPECT_EQ(RunPlan(manifest).hash, base);
  manifest.set_mode("federated");
  EXPECT_EQ(RunPlan(manifest).hash, base);
  EXPECT_EQ(RunPlan(manifest).manifest().mode(), "federated");

  // Write it to a file and read it again, like the services.
  proto::Manifest read;
  ASSERT_TRUE(read.ParseFromString(some_manifest().SerializeAsString()));
  EXPECT_EQ(RunPlan(read).hash, base);

  std::set<std::uint64_t> hashes{base};
  const auto add = [&hashes](auto change) {
    proto::Manifest changed = some_manifest();
    change(changed);
    hashes.insert(RunPlan(std::move(changed)).hash);
  };
  add([](proto::Manifest& m) { m.set_run(78); });
  add([](proto::Manifest& m) { m.mutable_experiment()->set_seed(10); });
  add([](proto::Manifest& m) { m.mutable_experiment()->mutable_deployment()->set_hosts(3); });
  add([](proto::Manifest& m) { m.set_x_mm(16, 16.000000000000004); });
  add([](proto::Manifest& m) { m.set_group_program(0, 0); });
  add([](proto::Manifest& m) { m.mutable_program(1)->set_sha256("0"); });
  add([](proto::Manifest& m) { m.mutable_experiment()->mutable_motion()->set_noise(false); });
  EXPECT_EQ(hashes.size(), 8u);
}

TEST(RunPlan, RefusesInvalidManifests) {
  const auto refused = [](auto change) {
    proto::Manifest manifest = some_manifest();
    change(manifest);
    try {
      const RunPlan plan(std::move(manifest));
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused([](proto::Manifest& m) { m.set_format(2); }),
            "manifest: is of format 2; this program reads format 1: prepare the run again");
  EXPECT_EQ(refused([](proto::Manifest&) {}), "accepted");
  const auto wrong = [&refused](auto change) { return refused(change).substr(0, 10) == "manifest: "; };
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.add_x_mm(3); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_heading_rad()->RemoveLast(); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_experiment()->mutable_robots(0)->set_count(6); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.add_group_program(0); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.set_group_program(0, 2); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_experiment()->mutable_deployment()->set_hosts(0); }));
  EXPECT_TRUE(
      wrong([](proto::Manifest& m) { m.mutable_experiment()->mutable_deployment()->set_partition_rows(0); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_experiment()->set_tick_cycles(0); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_experiment()->set_duration_s(std::nan("")); }));
  EXPECT_TRUE(wrong([](proto::Manifest& m) { m.mutable_experiment()->mutable_arena()->set_height_mm(0); }));
}

}  // namespace
}  // namespace kilotwin
