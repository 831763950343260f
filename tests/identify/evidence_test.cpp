// Evidence of hypotheses beside a model.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/search/hypotheses.hpp"
#include "clients/identify/search/score_test.hpp"
#include "tests/identify/small_set.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"

namespace kilotwin {
namespace {

using identify::Dictionary;
using identify::Hypothesis;

/// Log of the integral over all columns of a likelihood with this information and score, times a prior of this precision whose gradient
/// the score contains.
double log_integral(const Eigen::MatrixXd& information, const Eigen::VectorXd& score,
                    const Eigen::VectorXd& precision) {
  Eigen::MatrixXd all = information;
  all.diagonal() += precision;
  const Eigen::LLT<Eigen::MatrixXd> root(all);
  return 0.5 * score.dot(root.solve(score)) - root.matrixLLT().diagonal().array().log().sum() +
         0.5 * precision.array().log().sum();
}

TEST(Evidence, OfAHypothesisIsThatOfTheModelWithItsColumns) {
  // A curve that its prior holds near 0: most of the battery's effect is left, and the model's columns nearly contain it.
  auto&& [set, fitter, state] = BaseFit(small({truth::battery_by_the_clock()}));
  const identify::Extent extent = identify::extent_of(state.tracks);
  const Dictionary first = identify::dictionary_of(extent);
  const auto named = [](const Dictionary& dictionary, const char* name) {
    return std::find_if(dictionary.hypotheses.begin(), dictionary.hypotheses.end(),
                        [&](const Hypothesis& h) { return h.name == name && h.columns.size() == 3; });
  };
  ASSERT_NE(named(first, "speed-by-time"), first.hypotheses.end());
  identify::Term held = first.term_of(*named(first, "speed-by-time"), 1);
  held.precision.setConstant(3e4);
  state.model.terms.push_back(held);
  fitter.fit_until_settled(state);

  Dictionary dictionary = identify::dictionary_of(extent);
  std::erase_if(dictionary.hypotheses, [](const Hypothesis& h) { return h.name.find("speed-by-") != 0; });
  std::vector<identify::Block> blocks = identify::blocks_of(state.model);
  blocks.insert(blocks.end(), dictionary.blocks.begin(), dictionary.blocks.end());
  const std::vector<identify::Unit> units = identify::linearise(state.model, state.tracks.units(), blocks, {});
  const identify::ScoreTest test(fitter, state.model, units, dictionary);

  const Eigen::Index all = units.front().information.rows(), own = all - dictionary.columns();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all), prior = information;
  Eigen::VectorXd score = Eigen::VectorXd::Zero(all);
  for (const identify::Unit& unit : units) {
    information += unit.information;
    score += unit.score;
  }
  fitter.add_base_prior(state.model, prior, score);
  const identify::Term& term = state.model.terms.front();
  const Eigen::Index of_term = own - term.coefficients.size();
  score.segment(of_term, term.coefficients.size()) -= term.precision.cwiseProduct(term.coefficients);
  Eigen::VectorXd precision = prior.diagonal();
  precision.segment(of_term, term.coefficients.size()) = term.precision;

  std::vector<Eigen::Index> columns(static_cast<std::size_t>(own));
  for (Eigen::Index i = 0; i < own; ++i) columns[static_cast<std::size_t>(i)] = i;
  const double without = log_integral(information(columns, columns), score(columns), precision(columns));
  int compared = 0;
  for (const Hypothesis& h : dictionary.hypotheses) {
    const identify::Finding found = test.evidence_of(h, -1);
    // Of those with one column per key and no directions without information.
    if (found.degrees != static_cast<int>(h.columns.size()) || !(found.evidence > 0)) continue;
    const Eigen::VectorXd scale = found.relative_scale * dictionary.scale(h.columns);
    std::vector<Eigen::Index> with = columns;
    Eigen::VectorXd its = precision;
    for (std::size_t i = 0; i < h.columns.size(); ++i) {
      with.push_back(own + h.columns[i]);
      its[with.back()] = 1 / (scale[static_cast<Eigen::Index>(i)] * scale[static_cast<Eigen::Index>(i)]);
    }
    const double gain = log_integral(information(with, with), score(with), its(with)) - without;
    // 1: the price of choosing the scale.
    EXPECT_NEAR(found.evidence, gain - h.log_choices - 1, 0.05 + 0.002 * gain) << h.name;
    ++compared;
  }
  EXPECT_GE(compared, 5);
}

TEST(Evidence, OfRobotsWhoseBiasChangesNeedsNoGeneralTerm) {
  EXPECT_EQ(found_in(small({truth::replaced_robots()})), "bias-by-robot-and-time");
}

TEST(Evidence, TellsMotorTimeFromTimeInAProduct) {
  truth::Effect wear;
  wear.name = "wear";
  wear.push = [](const truth::Situation& at, truth::Push& push) {
    const double d2 = (std::pow(at.disc.x - 60, 2) + std::pow(at.disc.y - 40, 2)) / (200.0 * 200.0);
    const double gain = 1 - 0.5 * std::min(1.0, (at.driven_s.left + at.driven_s.right) / 200) / (1 + d2 * d2);
    push.gain.left *= gain;
    push.gain.right *= gain;
  };
  truth::Scene scene = small({wear});
  scene.train_s = 150;
  EXPECT_EQ(found_in(scene), "speed-by-motor-time-and-position");
}

TEST(Evidence, APartOfAProductIsTakenIntoIt) {
  truth::Scene scene = small({truth::warming_patch()});
  scene.train_s = 150;
  EXPECT_EQ(found_in(scene), "speed-by-time-and-position");
}

}  // namespace
}  // namespace kilotwin
