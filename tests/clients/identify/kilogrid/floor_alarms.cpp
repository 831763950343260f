// Rates of false alarms and of detections in the search for effects on a floor, on sets of an independent
// generator (plain_floor.hpp). Usage: floor_alarms SETS ROBOTS SECONDS RUNS [FIRST-SET] [EFFECT...]; without
// effects: all.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "clients/identify/kilogrid/floor_search.hpp"
#include "tests/clients/identify/kilogrid/plain_floor.hpp"

namespace {

using namespace kilotwin::kilogrid;

struct PlantedEffect {
  test::Truth truth;
  const char* name;
  std::vector<std::string> named;  ///< accepted effects with the right covariate
};

const std::vector<PlantedEffect> kPlantedEffects = {
    {test::Truth::kNothing, "nothing", {}},
    {test::Truth::kTwoKindsOfRobots, "two-kinds", {"speed-of-robots"}},
    {test::Truth::kCaughtByWalls, "caught-by-walls", {"stuck-beside-walls", "wall"}},
    {test::Truth::kDeadPatch, "dead-patch", {"slope-of-speed", "middle"}},
    {test::Truth::kSlowerAtHalfTime, "half-time", {"slowing"}},
    {test::Truth::kTired, "tired", {"slowing"}},
    {test::Truth::kSlowCorner, "slow-corner", {"slope-of-speed", "middle"}},
    {test::Truth::kDriftInTheMiddle, "drift", {"drift"}},
    {test::Truth::kTurningSpells, "turning-spells", {"wandering-turn", "turning-of-robots"}},
    {test::Truth::kSlowInCrowds, "slow-in-crowds", {"crowd"}}};

FloorModel base_of(const FloorTarget& target, std::uint64_t seed) {
  FloorModel model;
  model.add(base_term());
  fit_from_far_start(model, target, seed, [](const std::string&) {});
  fit(model, target, 2, 1, seed, [](const std::string&) {});
  return model;
}

}  // namespace

int main(int argc, char** argv) {
  const auto given = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const int sets = given(1, 12), robots = given(2, 40), seconds = given(3, 1500), runs = given(4, 3),
            begin = given(5, 0);
  const std::vector<std::string> wanted(argv + std::min(argc, 6), argv + argc);
  for (const PlantedEffect& cause : kPlantedEffects) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), cause.name) == wanted.end()) continue;
    for (int set = begin; set < begin + sets; ++set) {
      std::vector<FloorRun> played;
      for (int r = 0; r < runs; ++r)
        played.push_back(test::play(cause.truth, static_cast<std::size_t>(robots), seconds,
                                    static_cast<std::uint64_t>(1000 * set + r + 1)));
      const FloorTarget target(played, {});
      const auto progress = [](const kilotwin::stats::Work& work) {
        if (std::getenv("FLOOR_ALARMS_VERBOSE") != nullptr) fmt::print("  {} {}\n", work.stage, work.activity);
      };
      const FloorFound found =
          search_effects(base_of(target, static_cast<std::uint64_t>(set + 1)), target, candidate_terms({}),
                         progress, [](const std::string&, const FloorModel&) {});
      std::string line = fmt::format("{} {}: found", cause.name, set);
      bool named = false, others = false;
      for (const EffectGain& effect : found.gains) {
        const bool says = std::find(cause.named.begin(), cause.named.end(), effect.name) != cause.named.end();
        (says ? named : others) = true;
        line += fmt::format(" {} {:.0f}/{:.0f}", effect.name, effect.gain, effect.needed);
      }
      if (found.gains.empty()) line += " nothing";
      // The closest of the rejected candidates.
      const auto share = [](const RejectedEffect& e) { return e.gain.gain / std::max(e.gain.needed, 1e-9); };
      const auto next = std::max_element(found.rejected.begin(), found.rejected.end(),
                                         [&](const auto& a, const auto& b) { return share(a) < share(b); });
      if (next != found.rejected.end())
        line += fmt::format("; next {} {:.0f}/{:.0f}", next->gain.name, next->gain.gain, next->gain.needed);
      if (!cause.named.empty()) line += named ? " - named" : " - not named";
      if (others) line += cause.named.empty() ? " - FALSE ALARM" : ", and others";
      fmt::print("{}\n", line);
      std::fflush(stdout);
    }
  }
}
