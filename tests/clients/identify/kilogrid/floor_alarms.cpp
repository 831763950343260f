// How often the search for effects on a floor finds one where there is none, and whether it names one that is there: on sets by
// a generator of its own (plain_floor.hpp). floor_alarms [SETS] [ROBOTS] [SECONDS]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "clients/identify/kilogrid/floor_fit.hpp"
#include "tests/clients/identify/kilogrid/plain_floor.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin::kilogrid;
  const auto given = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const int sets = given(1, 20), robots = given(2, 40), seconds = given(3, 1500);
  const struct {
    test::Truth truth;
    const char *name, *cause;
  } truths[] = {{test::Truth::kNothing, "nothing", ""},
                {test::Truth::kTwoKindsOfRobots, "two kinds of robots", "robot"},
                {test::Truth::kCaughtByWalls, "caught by walls", "position"},
                {test::Truth::kDeadPatch, "dead patch", "position"},
                {test::Truth::kSlowerAtHalfTime, "slower at half time", "time"}};
  for (const auto& truth : truths) {
    const int repeats = truth.truth == test::Truth::kNothing ? sets : std::max(sets / 10, 1);
    for (int set = 0; set < repeats; ++set) {
      std::vector<FloorRun> runs;
      for (int r = 0; r < 3; ++r)
        runs.push_back(test::play(truth.truth, static_cast<std::size_t>(robots), seconds,
                                  static_cast<std::uint64_t>(1000 * set + r + 1)));
      const FloorTarget target(runs, {});
      FloorModel model;
      model.add(base_term());
      const auto quiet = [](const std::string&) {};
      const auto seed = static_cast<std::uint64_t>(set + 1);
      fit(model, target, 2, 0.7, seed, quiet);
      const std::vector<FloorTerm> candidates = candidate_terms({});
      std::vector<double> gains;
      const auto chosen = choose(model, candidates, target, 1e9, seed, quiet, &gains);
      std::vector<std::size_t> order(gains.size());
      for (std::size_t c = 0; c < order.size(); ++c) order[c] = c;
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return gains[a] > gains[b]; });
      fmt::print("{} {}:", truth.name, set);
      for (std::size_t k = 0; k < 4; ++k) fmt::print(" {} {:.0f}", candidates[order[k]].name, gains[order[k]]);
      const auto& first = candidates[order[0]].covariates;
      if (*truth.cause != 0)
        fmt::print(" - {}",
                   std::find(first.begin(), first.end(), truth.cause) != first.end() ? "named" : "not named");
      fmt::print("\n");
      std::fflush(stdout);
    }
  }
}
