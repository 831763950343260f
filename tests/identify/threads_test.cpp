// The number of threads changes no octet of a result, and each unit of work was announced by the unit before it.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "clients/identify/identify.hpp"
#include "clients/identify/model/model_file.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "clients/identify/result/result_json.hpp"
#include "clients/identify/search/work.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"

namespace kilotwin::identify {
namespace {

/// A set with a battery, and robots that meet; a part is held out.
MeasuredSet battery_set() {
  MeasuredSet set = set_of(small({truth::battery_by_the_clock()}), played(small({truth::battery_by_the_clock()})));
  hold_out_part(set);
  return set;
}

std::vector<double> numbers_of(const std::vector<Prediction>& predictions) {
  std::vector<double> out;
  for (const Prediction& p : predictions)
    out.insert(out.end(), {p.time_s, p.before_x_mm, p.before_y_mm, p.after_x_mm, p.after_y_mm});
  return out;
}

TEST(Threads, ChangeNoResult) {
  const MeasuredSet set = battery_set();
  Options options;
  options.threads = 1;
  const Identified one = identify(set, nullptr, options);
  EXPECT_GT(one.found.result().effects_size(), 0);
  EXPECT_FALSE(one.predictions.empty());
  for (const std::uint32_t threads : {2U, 3U}) {
    options.threads = threads;
    const Identified more = identify(set, nullptr, options);
    EXPECT_EQ(json_of(more.found.result()), json_of(one.found.result())) << threads;
    EXPECT_EQ(text_of(more.model, ""), text_of(one.model, "")) << threads;
    EXPECT_EQ(numbers_of(more.predictions), numbers_of(one.predictions)) << threads;
  }
}

TEST(WorkLog, AnnouncesEachUnitBeforeItBegins) {
  for (const bool find_effects : {false, true}) {
    const MeasuredSet set = battery_set();
    std::vector<stats::Work> reports;
    Options options;
    options.find_effects = find_effects;
    options.progress = [&](const stats::Work& work) { reports.push_back(work); };
    const Identified found = identify(set, nullptr, options);
    ASSERT_FALSE(reports.empty());
    EXPECT_EQ(reports.front().kind, kBaseModel);
    EXPECT_EQ(reports.back().kind, kSimulation);
    for (std::size_t i = 1; i < reports.size(); ++i) {
      double announced = 0;
      for (const stats::WorkLeft& left : reports[i - 1].left) {
        EXPECT_GE(left.likely, 0);
        EXPECT_GE(left.most, left.likely);
        if (left.kind == reports[i].kind) announced += left.most;
      }
      EXPECT_GE(announced, reports[i].cost - 1e-9) << reports[i].stage << ": " << reports[i].activity;
    }
    // Only the caller's page is left at the end, and only a search tests hypotheses.
    ASSERT_EQ(reports.back().left.size(), 1U);
    EXPECT_EQ(reports.back().left.front().kind, kReport);
    const auto tests = std::count_if(reports.begin(), reports.end(), [](const auto& w) { return w.kind == kTest; });
    EXPECT_EQ(tests > 0, find_effects);
  }
}

}  // namespace
}  // namespace kilotwin::identify
