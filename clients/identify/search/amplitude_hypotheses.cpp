#include "clients/identify/search/covariate_hypotheses.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "clients/identify/search/amplitudes.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Name of a covariate in effect names and in result.json.
std::pair<std::string, std::string> covariate_words(Covariate covariate) {
  switch (covariate) {
    case Covariate::kTime: return {"time", "time"};
    case Covariate::kX:
    case Covariate::kY:
    case Covariate::kRadius:
    case Covariate::kPointDistance: return {"position", "position"};
    case Covariate::kHeading: return {"heading", "heading"};
    case Covariate::kCommand: return {"command", "command"};
    case Covariate::kSinceCommand: return {"time-since-command", "time_since_command"};
    case Covariate::kMotorTime:
    case Covariate::kLeftMotorTime:
    case Covariate::kRightMotorTime:
    case Covariate::kMotorTimeSum:
    case Covariate::kDrivenTime: return {"motor-time", "motor_time"};
    case Covariate::kNeighbours:
    case Covariate::kNearest:
    case Covariate::kDensity:
    case Covariate::kBearing: return {"neighbours", "neighbours"};
    case Covariate::kRobot: return {"robot", "robot"};
    default: return {"history", "history"};
  }
}

/// A function of known factors, with its covariates. Amplitudes multiply it.
struct Multiplied {
  Basis basis;
  std::string name;                ///< "time"; empty: a constant
  std::vector<std::string> words;  ///< covariates
  [[nodiscard]] bool is_of(const std::string& word) const {
    return std::find(words.begin(), words.end(), word) != words.end();
  }
};

/// The function of a term that amplitudes can multiply; nothing: it has no such form.
std::optional<Multiplied> multiplied_by(const Term& term) {
  const std::vector<Factor>& factors = term.blocks.front().basis.factors;
  Multiplied out;
  if (factors.empty()) return out;
  if (factors.size() > 1 || factors.front().shape == Shape::kTable || !factors.front().known.empty())
    return std::nullopt;
  out.basis.factors = {known_curve(term, 0)};
  for (const Factor& factor : out.basis.factors) {
    const auto [name, word] = covariate_words(factor.axis.of);
    if (out.is_of(word)) return std::nullopt;
    out.name += (out.name.empty() ? "" : "-and-") + name;
    out.words.push_back(word);
    if (factor.axis.of != Covariate::kPointDistance) continue;
    out.name += "-and-time";
    out.words.emplace_back("time");
  }
  return out;
}

/// The amplitude of a known function may depend on time, place or heading. The known factors come
/// first, so that they are written once.
void of_known_and_more(DictionaryBuilder& make, const Extent& extent, const TargetGroup& group,
                       const Multiplied& known, std::uint8_t during) {
  if (&group == &kWorld || known.words.empty()) return;
  const auto beside = [&](const char* word, Factor factor, std::initializer_list<Eigen::Index> sizes) {
    if (known.is_of(word)) return;
    Basis basis = known.basis;
    basis.factors.push_back(std::move(factor));
    const auto bases = make.put(group, basis, during);
    std::string name = known.name + "-and-" + word;
    std::vector<std::string> words = known.words;
    words.emplace_back(word);
    // Apart from maps that change with time, whose name is the other way round.
    if (words == std::vector<std::string>{"position", "time"}) {
      std::swap(words[0], words[1]);
      name = "time-and-position";
    }
    for (const Eigen::Index size : sizes) make.add(group, name, words, some(bases, 0, size));
  };
  beside("time", over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, 6), {1, 2, 6});
  beside("position", plane(extent, 3), {1, 2, 9});
  beside("heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2), {2, 4});
}

}  // namespace

void add_amplitude_hypotheses(DictionaryBuilder& make, const Extent& extent, const std::vector<Term>& terms) {
  constexpr std::size_t kMostRobots = 40;
  for (const Term& term : terms) {
    const Block& block = term.blocks.front();
    const TargetGroup* group = nullptr;
    for (const TargetGroup* one : {&kSpeed, &kTurning, &kSlip, &kWorld})
      if (one->targets.front() == block.target) group = one;
    const std::optional<Multiplied> known = group != nullptr ? multiplied_by(term) : std::nullopt;
    if (!known) continue;
    const auto amplitudes = [&](Covariate covariate, const std::vector<double>& keys) {
      const auto [name, word] = covariate_words(covariate);
      // The amplitudes of a drift along x and along y share one shape only for a single-component curve.
      if ((group == &kWorld && !known->words.empty()) || known->is_of(word)) return;
      Basis basis = known->basis;
      basis.factors.insert(basis.factors.begin(), keyed(Shape::kTable, covariate, keys));
      std::vector<std::string> words = known->words;
      words.push_back(word);
      make.add(*group, known->name.empty() ? name : name + "-and-" + known->name, words,
               some(make.put(*group, basis, block.during), 0, static_cast<Eigen::Index>(keys.size())));
    };
    if (extent.has_straight && extent.has_turns) amplitudes(Covariate::kCommand, {1, 2, 3});
    if (group != &kWorld && extent.robots.size() > 1 && extent.robots.size() <= kMostRobots)
      amplitudes(Covariate::kRobot, {extent.robots.begin(), extent.robots.end()});
    of_known_and_more(make, extent, *group, *known, block.during);
  }
}

}  // namespace kilotwin::identify
