#include "clients/identify/search/work.hpp"

#include <algorithm>
#include <array>

namespace kilotwin::identify {
namespace {

/// In seconds of two quiet cores, as measured on scenes of tests/identify with 24 robots. A run corrects them by its own times.
/// `bench/identification remaining` compares the estimates with the time that remained.
struct Cost {
  double base, by_term;
};
constexpr std::array<Cost, kReport + 1> kCosts = {{
    {0.8, 0},    // kBaseModel
    {3.5, 0},    // kTest
    {3.5, 0.5},  // kAddition
    {0, 1.1},    // kAlternatives
    {1.2, 0},    // kGeneralTerms
    {0, 0.35},   // kTermChecks
    {3.7, 1.5},  // kLastCheck
    {1, 0.25},   // kErrors
    {1.2, 0},    // kUnexplained
    {0.3, 0},    // kHorizon
    {0.8, 0},    // kSimulation
    {1, 0},      // kReport
}};

double cost_of(int kind, double terms) {
  const Cost& cost = kCosts[static_cast<std::size_t>(kind)];
  return cost.base + cost.by_term * terms;
}

/// Changes of the model after a unit, as expected: their mean over the scenes of tests/identify.
double likely_changes(WorkKind now, double terms) {
  // Changes after the base model, after a search with terms, and once the search is over. Wrong values spoil the estimate
  // of the remaining time, but no result.
  constexpr double kOfBaseModel = 1.2, kOfExtended = 0.4, kNothingPassed = 0.1;
  if (now >= kAlternatives) return kNothingPassed;
  return terms == 0 ? kOfBaseModel : kOfExtended;
}

/// Units of a kind of the search that follow a unit of another kind, if the model changes so many times more.
double units_left(int kind, WorkKind now, double changes) {
  // Each change takes a test and an addition. The last test passes nothing.
  if (kind == kTest) return changes + (now == kBaseModel || now == kAddition ? 1 : 0);
  if (kind == kAddition) return changes;
  return kind > now || changes > 1 ? 1 : 0;
}

}  // namespace

void WorkLog::begin(WorkKind kind, const std::string& stage, const std::string& activity, std::size_t terms,
                    std::optional<int> most_changes) const {
  if (!report_) return;
  const auto now = static_cast<double>(terms);
  const double most = most_changes.value_or(0), likely = std::min(likely_changes(kind, now), most);
  stats::Work work{stage, activity, kind, cost_of(kind, now), {}};
  if (most_changes) {
    for (int k = kTest; k <= kGeneralTerms; ++k) {
      const auto cost = [&](double changes) {
        return units_left(k, kind, changes) * cost_of(k, now + changes / 2);
      };
      work.left.push_back({k, cost(likely), cost(most)});
    }
  }
  const int first_after = most_changes ? static_cast<int>(kTermChecks) : std::max<int>(kind + 1, kLastCheck);
  for (int k = first_after; k <= kReport; ++k)
    work.left.push_back({k, cost_of(k, now + likely), cost_of(k, now + most)});
  report_(work);
}

}  // namespace kilotwin::identify
