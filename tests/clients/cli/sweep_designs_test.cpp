#include "clients/cli/sweep_designs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/cli/sweep_runs.hpp"

namespace kilotwin::cli {
namespace {

const std::vector<std::filesystem::path> kModels{"m/1.txtpb", "m/2.txtpb", "m/3.txtpb"};

/// Values of two designs with three models; the noise of a seed is common to all.
SweepDesigns filled(bool largest) {
  const std::vector<SweepPoint> points = with_models(sweep_points({"f=a,b"}), kModels);
  SweepDesigns designs(points, largest);
  const double values[] = {12, 12, 2, 8, 8.5, 7.5};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (std::size_t point = 0; point < points.size(); ++point)
      designs.add(point, seed, values[point] + 100 * std::sin(static_cast<double>(seed)));
  }
  return designs;
}

TEST(SweepDesigns, AFragileDesignRanksBelowASteadyOne) {
  const std::vector<Design> ranked = filled(true).ranked();
  ASSERT_EQ(ranked.size(), 2u);
  EXPECT_EQ(ranked[0].fields, SweepPoint{"f=b"});
  EXPECT_EQ(ranked[1].fields, SweepPoint{"f=a"}) << "best with most models and at the mean, worst with the third";
  EXPECT_GT(ranked[1].over_models.mean(), ranked[0].over_models.mean());
  EXPECT_EQ(ranked[1].worst_model, "m/3.txtpb");
  EXPECT_EQ(ranked[1].rank, 2u);
  // Seeds are paired: their noise is in no difference.
  EXPECT_NEAR(ranked[1].to_best.mean(), (4 + 3.5 - 5.5) / 3, 1e-9);
  EXPECT_EQ(ranked[1].to_best.count(), 3u);
  EXPECT_NEAR(ranked[0].to_best.standard_error(), 0, 1e-12);
}

TEST(SweepDesigns, WhereSmallIsGoodTheLargestValueIsTheWorst) {
  const std::vector<Design> ranked = filled(false).ranked();
  EXPECT_EQ(ranked[0].fields, SweepPoint{"f=b"});
  EXPECT_EQ(ranked[0].worst_model, "m/2.txtpb");
  EXPECT_EQ(ranked[1].worst_model, "m/1.txtpb");
}

TEST(SweepDesigns, ADesignThatFailsWithAModelHasNoRank) {
  const std::vector<SweepPoint> points = with_models(sweep_points({"f=a,b"}), kModels);
  SweepDesigns designs(points, true);
  for (const std::size_t point : std::vector<std::size_t>{0, 1, 3, 4, 5})
    designs.add(point, 1, point == 0 ? 1000.0 : 1.0);
  designs.add(2, 1, std::nan(""));
  const std::vector<Design> ranked = designs.ranked();
  EXPECT_EQ(ranked[0].fields, SweepPoint{"f=b"});
  EXPECT_EQ(ranked[1].rank, 0u);
  const std::string csv = designs_csv(ranked, "msd");
  EXPECT_TRUE(csv.starts_with("rank,f,models,msd,msd_se,worst,worst_model,to_best,to_best_se\n1,b,3,1,0,1,"))
      << csv;
  EXPECT_NE(csv.find("\n,a,2,500.5,"), std::string::npos) << csv;
}

TEST(SweepDesigns, ARunTakesItsModelByItsOwnOption) {
  RunArguments arguments;
  arguments.experiment = "e.txtpb";
  const std::vector<std::string> words = run_words(arguments, {"f=a", "model=m/1.txtpb"}, 3, "out");
  const std::vector<std::string> expected{"kilotwin", "run",   "e.txtpb", "--mode",   "local",
                                          "--quiet",  "--out", "out",     "--seed",   "3",
                                          "--set",    "f=a",   "--model", "m/1.txtpb"};
  EXPECT_EQ(words, expected);
}

}  // namespace
}  // namespace kilotwin::cli
