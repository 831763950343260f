/// Small scenes as measured sets, for tests of parts of the identification.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/fit/fitter.hpp"
#include "clients/identify/search/search.hpp"
#include "tests/identify/truth/files.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace kilotwin {

/// Ten robots, two runs of 120 s, in an arena of 700 mm.
inline truth::Scene small(std::vector<truth::Effect> effects) {
  truth::Scene scene = truth::scenario("nothing-tidy");
  scene.robots = 10;
  scene.train_runs = 2;
  scene.train_s = 120;
  scene.test_runs = 0;
  scene.width_mm = scene.height_mm = 700;
  scene.effects = std::move(effects);
  return scene;
}

inline truth::Play played(const truth::Scene& scene, std::uint64_t seed = 5) { return truth::play(scene, seed); }

inline identify::MeasuredSet set_of(const truth::Scene& scene, const truth::Play& play) {
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("general-" + std::to_string(getpid()) + "-" + test->name());
  truth::write_data(scene, play.train, folder);
  identify::MeasuredSet set = identify::load_measured_set(folder);
  std::filesystem::remove_all(folder);
  return set;
}

/// A set and its base model, fitted.
struct BaseFit {
  explicit BaseFit(identify::MeasuredSet data) : set(std::move(data)), fitter(set, 2), state(set) {
    fitter.fit_base(state);
  }
  explicit BaseFit(const truth::Scene& scene, std::uint64_t seed = 5)
      : BaseFit(set_of(scene, played(scene, seed))) {}
  BaseFit(const BaseFit&) = delete;
  BaseFit& operator=(const BaseFit&) = delete;

  const identify::MeasuredSet set;
  const identify::Fitter fitter;
  identify::FitState state;
};

/// Names of the effects that the search finds, with commas.
inline std::string found_in(const truth::Scene& scene, std::uint64_t seed = 5) {
  const BaseFit base(scene, seed);
  const identify::Search found = identify::search(base.fitter, base.state, identify::WorkLog({}));
  std::string names;
  for (const identify::Term& term : found.fit.model.terms) names += (names.empty() ? "" : ", ") + term.name;
  return names;
}

}  // namespace kilotwin
