// The last check: terms that do not help leave, terms that do stay, and the base model replaces what was found.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/last_check.hpp"
#include "clients/identify/search/hypotheses.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"

namespace kilotwin::identify {
namespace {

/// A set with a battery, its base model, and a model with one term for each name.
class LastCheck : public testing::Test {
 protected:
  LastCheck() : set_(held_out(set_of(scene_, played(scene_)))), fitter_(set_, 2), base_(set_) {
    fitter_.fit_base(base_);
  }

  FitState with(const std::vector<std::string>& names) const {
    FitState state = base_;
    const Dictionary all = dictionary_of(extent_of(base_.tracks), {});
    for (const std::string& name : names) {
      const auto h = std::find_if(all.hypotheses.begin(), all.hypotheses.end(),
                                  [&](const Hypothesis& one) { return one.name == name; });
      EXPECT_NE(h, all.hypotheses.end()) << name;
      state.model.terms.push_back(all.term_of(*h, 1));
    }
    fitter_.fit(state, 2);
    return state;
  }
  Findings found(FitState fit) const {
    const std::vector<Reason> reasons(fit.model.terms.size());
    Findings f(base_, {std::move(fit), reasons, {{base_, {}}}, {}, {}, {}, {}});
    for (const Term& term : f.found.fit.model.terms) f.found.steps.push_back({term.name, 1});
    return f;
  }
  static std::vector<std::string> names_of(const Search& found) {
    std::vector<std::string> names;
    for (const Term& term : found.fit.model.terms) names.push_back(term.name);
    return names;
  }
  [[nodiscard]] Evaluation choosing() const { return {set_, nullptr, Tracks::kChoosing, 2}; }
  static MeasuredSet held_out(MeasuredSet set) {
    hold_out_for_choice(set);
    return set;
  }

  const ForecastTimes times_{10, 5, 10};
  const truth::Scene scene_ = small({truth::battery_by_the_clock()});
  const MeasuredSet set_;
  const Fitter fitter_;
  FitState base_;
};

TEST_F(LastCheck, TakesOutUselessTermsOnly) {
  Findings f = found(with({"speed-by-time", "speed-by-neighbours"}));
  choose_on_held_out(f, fitter_, choosing(), times_);
  EXPECT_EQ(names_of(f.found), std::vector<std::string>{"speed-by-time"});
  EXPECT_EQ(f.found.reasons.size(), 1U);
  EXPECT_EQ(f.check.gains.size(), 1U);
  EXPECT_GT(f.check.gains.front().nat, 0);
  EXPECT_EQ(f.check.dropped, std::vector<std::string>{"speed-by-neighbours"});
  // A dropped effect is among the rejected ones, with the reason.
  ASSERT_EQ(f.found.rejected.size(), 1U);
  EXPECT_FALSE(f.found.rejected.front().why.empty());
}

TEST_F(LastCheck, RefusesAModelThatPredictsWorse) {
  FitState wrong = with({"speed-by-time"});
  wrong.model.terms.front().coefficients *= -3;
  Findings f = found(std::move(wrong));
  choose_on_held_out(f, fitter_, choosing(), times_);
  EXPECT_TRUE(f.found.fit.model.terms.empty());
  EXPECT_EQ(f.check.dropped, std::vector<std::string>{"speed-by-time"});
}

TEST(LastCheckWithoutHeadings, IsNotDecidedByForecastsBeforeTheHeadingIsKnown) {
  // At first forecasts are off by tens of mm. Later ones show the effect, which a plain mean over all of them hardly sees.
  truth::Scene scene = small({truth::battery_by_the_clock()});
  scene.heading = false;
  MeasuredSet whole = set_of(scene, played(scene));
  hold_out_for_choice(whole);
  auto&& [set, fitter, base] = BaseFit(std::move(whole));
  const Evaluation choosing(set, nullptr, Tracks::kChoosing, 2);
  const ForecastTimes times{10, 5, 10};
  const Dictionary all = dictionary_of(extent_of(base.tracks), {});
  FitState battery = base;
  const auto h = std::find_if(all.hypotheses.begin(), all.hypotheses.end(),
                              [](const Hypothesis& one) { return one.name == "speed-by-time"; });
  ASSERT_NE(h, all.hypotheses.end());
  battery.model.terms.push_back(all.term_of(*h, 1));
  fitter.fit(battery, 2);
  Findings f(base, {battery, {{}}, {{base, {}}}, {}, {}, {}, {}});
  choose_on_held_out(f, fitter, choosing, times);
  ASSERT_EQ(f.check.path.size(), 2U);
  const double plain =
      choosing.judge(battery, times).errors.rmse_mm() / choosing.judge(base, times).errors.rmse_mm();
  const double by_variance = f.check.path[1].rmse_mm / f.check.path[0].rmse_mm;
  EXPECT_LT(by_variance, 0.9);
  EXPECT_LT(by_variance, 0.95 * plain);
}

TEST_F(LastCheck, KeepsTheBaseModelInPlaceOfWhatWasFound) {
  Findings f = found(with({"speed-by-time", "turning-by-heading"}));
  f.check.gains.resize(2);
  keep_base_model(f);
  EXPECT_TRUE(f.found.fit.model.terms.empty());
  EXPECT_TRUE(f.found.reasons.empty());
  EXPECT_TRUE(f.check.gains.empty());
  EXPECT_EQ(f.check.kept, 0U);
  EXPECT_TRUE(f.found.steps.empty());
  EXPECT_EQ(f.check.dropped, (std::vector<std::string>{"speed-by-time", "turning-by-heading"}));
  EXPECT_EQ(f.found.fit.model.base.straight_mm_s, base_.model.base.straight_mm_s);
}

}  // namespace
}  // namespace kilotwin::identify
