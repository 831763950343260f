#include "clients/identify/search/covariate_hypotheses.hpp"

#include <algorithm>
#include <utility>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Name of a covariate in effect names and in result.json.
std::pair<std::string, std::string> covariate_words(Covariate covariate) {
  switch (covariate) {
    case Covariate::kTime: return {"time", "time"};
    case Covariate::kX:
    case Covariate::kY:
    case Covariate::kRadius: return {"position", "position"};
    case Covariate::kHeading: return {"heading", "heading"};
    case Covariate::kCommand: return {"command", "command"};
    case Covariate::kSinceCommand: return {"time-since-command", "time_since_command"};
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kDrivenTime: return {"motor-time", "motor_time"};
    case Covariate::kNeighbours:
    case Covariate::kNearest:
    case Covariate::kDensity:
    case Covariate::kBearing: return {"neighbours", "neighbours"};
    case Covariate::kRobot: return {"robot", "robot"};
    default: return {"history", "history"};
  }
}

/// The amplitude of a known curve over one covariate may depend on time, place or heading. The known factor comes
/// first, so that it is written once.
void of_known_and_more(DictionaryBuilder& make, const Extent& extent, const TargetGroup& group, const Basis& known,
                       std::uint8_t during) {
  if (&group == &kWorld || known.factors.empty()) return;
  const auto is = covariate_words(known.factors.front().axis.of);
  const auto beside = [&](const char* word, Factor factor, std::initializer_list<Eigen::Index> sizes) {
    if (is.second == word) return;
    Basis basis = known;
    basis.factors.push_back(std::move(factor));
    const auto bases = make.put(group, basis, during);
    std::string first = is.first;
    std::vector<std::string> words{is.second, word};
    if (words == std::vector<std::string>{"position", "time"}) {
      std::swap(words[0], words[1]);
      first = words[0];
    }
    for (const Eigen::Index size : sizes) make.add(group, first + "-and-" + words[1], words, some(bases, 0, size));
  };
  beside("time", over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, 6), {1, 2, 6});
  beside("position", plane(extent, 3), {1, 2, 9});
  beside("heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2), {2, 4});
}

}  // namespace

void add_amplitude_hypotheses(DictionaryBuilder& make, const Extent& extent, const std::vector<Term>& terms) {
  for (const Term& term : terms) {
    const Block& block = term.blocks.front();
    const TargetGroup* group = nullptr;
    for (const TargetGroup* one : {&kSpeed, &kTurning, &kSlip, &kWorld})
      if (one->targets.front() == block.target) group = one;
    if (group == nullptr || block.basis.factors.size() > 1) continue;
    std::string of;
    std::vector<std::string> words;
    Basis known;
    if (!block.basis.factors.empty()) {
      const Factor& factor = block.basis.factors.front();
      if (factor.shape == Shape::kTable || !factor.known.empty()) continue;
      of = "-and-" + covariate_words(factor.axis.of).first;
      words.push_back(covariate_words(factor.axis.of).second);
      known.factors.push_back(known_curve(term, 0));
    }
    const auto amplitudes = [&](Covariate covariate, const std::vector<double>& keys) {
      Basis basis = known;
      basis.factors.insert(basis.factors.begin(), keyed(Shape::kTable, covariate, keys));
      // The amplitudes of a drift along x and along y share one shape only for a single-component curve.
      if (group == &kWorld && !of.empty()) return;
      std::vector<std::string> all = words;
      all.push_back(covariate_words(covariate).second);
      make.add(*group, covariate_words(covariate).first + of, all,
               some(make.put(*group, basis, block.during), 0, static_cast<Eigen::Index>(keys.size())));
    };
    if (extent.has_straight && extent.has_turns) amplitudes(Covariate::kCommand, {1, 2, 3});
    if (group != &kWorld && extent.robots.size() > 1 && extent.robots.size() <= 40)
      amplitudes(Covariate::kRobot, {extent.robots.begin(), extent.robots.end()});
    of_known_and_more(make, extent, *group, known, block.during);
  }
}

}  // namespace kilotwin::identify
