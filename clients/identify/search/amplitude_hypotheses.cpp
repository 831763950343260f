#include "clients/identify/search/covariate_hypotheses.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "clients/identify/search/products.hpp"

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
    case Covariate::kPointDistance:
    case Covariate::kAlong: return {"position", "position"};
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
  Multiplied out;
  if (term.blocks.front().basis.factors.empty()) return out;
  out.basis.factors = functions_of(term);
  const std::vector<Factor>& factors = out.basis.factors;
  constexpr std::size_t kMostFunctions = 2;  // with the amplitudes three
  if (factors.empty() || factors.size() > kMostFunctions ||
      (factors.size() == 1 && factors.front().shape == Shape::kTable))
    return std::nullopt;
  for (const Factor& factor : out.basis.factors) {
    const auto [name, word] = covariate_words(factor.axis.of);
    if (out.is_of(word)) return std::nullopt;
    out.name += (out.name.empty() ? "" : "-and-") + name;
    out.words.push_back(word);
    if (factor.axis.of != Covariate::kPointDistance || factor.axis.point.stands()) continue;
    out.name += "-and-time";
    out.words.emplace_back("time");
  }
  return out;
}

/// Names of effects of three covariates list them in this order, whichever was found first.
constexpr std::array<std::pair<const char*, const char*>, 9> kOrder{{{"robot", "robot"},
                                                                     {"history", "history"},
                                                                     {"command", "command"},
                                                                     {"neighbours", "neighbours"},
                                                                     {"heading", "heading"},
                                                                     {"motor-time", "motor_time"},
                                                                     {"time-since-command", "time_since_command"},
                                                                     {"time", "time"},
                                                                     {"position", "position"}}};

/// Puts an effect of three covariates into the common order. Pairs keep theirs.
void put_in_order(std::string& name, std::vector<std::string>& words) {
  if (words.size() < 3) return;
  const auto place = [](const std::string& word) {
    return std::find_if(kOrder.begin(), kOrder.end(), [&](const auto& one) { return one.second == word; });
  };
  std::stable_sort(words.begin(), words.end(),
                   [&](const std::string& a, const std::string& b) { return place(a) < place(b); });
  name.clear();
  for (const std::string& word : words)
    name += (name.empty() ? "" : "-and-") + std::string(place(word) == kOrder.end() ? word : place(word)->first);
}

/// The amplitude of a known function may depend on one more covariate. The known factors come first, so that they are written once.
void of_known_and_more(DictionaryBuilder& make, const Extent& extent, const TargetGroup& group,
                       const Multiplied& known, std::uint8_t during) {
  if (known.words.empty()) return;
  const auto beside = [&](const char* word, Factor factor, std::initializer_list<Eigen::Index> sizes,
                          double choices = 1) {
    if (known.is_of(word)) return;
    Basis basis = known.basis;
    basis.factors.push_back(std::move(factor));
    const auto bases = make.put(group, basis, during);
    std::string name = known.name + "-and-" + covariate_words(basis.factors.back().axis.of).first;
    std::vector<std::string> words = known.words;
    words.emplace_back(word);
    // Apart from maps that change with time, whose name is the other way round.
    if (words == std::vector<std::string>{"position", "time"}) {
      std::swap(words[0], words[1]);
      name = "time-and-position";
    }
    put_in_order(name, words);
    for (const Eigen::Index size : sizes) make.add(group, name, words, some(bases, 0, size), choices);
  };
  // As many cosines over time as over motor time, or the latter would win at a step by its resolution.
  constexpr std::uint32_t kMostCosines = 16;
  beside("time", over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, kMostCosines),
         {1, 2, 6, kMostCosines});
  beside("position", plane(extent, 3), {1, 2, 9});
  beside("heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2), {2, 4});
  // Motor time and time rise together. Unless the data tell them apart, time is the simpler one.
  constexpr double kLikeTime = 20;
  if (extent.has_stop)
    beside("motor_time", over(Shape::kCosines, Covariate::kMotorTimeSum, 0, extent.sum_s, kMostCosines),
           {1, 2, 6, kMostCosines}, kLikeTime);
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, 5);
  since.warp = 1;
  beside("time_since_command", since, {1, 2, 5});
  if (!extent.neighbours) return;
  constexpr std::uint8_t kRadius = 8;  // index in kNeighbourRadii_mm: 120 mm, beyond which neighbours do not count
  Factor near = over(Shape::kTaper, Covariate::kNearest, 0, kNeighbourRadii_mm[kRadius], 3);
  near.axis.radius = kRadius;
  beside("neighbours", near, {1, 3});
}

}  // namespace

void add_amplitude_hypotheses(DictionaryBuilder& make, const Extent& extent, const std::vector<Term>& terms) {
  // Robots; with more, no amplitude of each robot is tried, which would take a column per robot.
  constexpr std::size_t kMostRobots = 40;
  for (const Term& whole : terms) {
    const Term term = main_part(whole);
    const Block& block = term.blocks.front();
    std::optional<TargetGroup> group;
    if (is_gain(block.target)) group = {kSpeed.name, kSpeed.in_words, {block.target}, {}};
    for (const TargetGroup* one : {&kTurning, &kSlip, &kWorld})
      if (one->targets.front() == block.target) group = *one;
    const std::optional<Multiplied> known = group ? multiplied_by(term) : std::nullopt;
    if (!known) continue;
    const bool is_drift = group->targets.size() > 1;
    const auto amplitudes = [&](Covariate covariate, const std::vector<double>& keys) {
      const auto [name, word] = covariate_words(covariate);
      // The amplitudes of a drift along x and along y share one shape only for a single-component curve.
      if ((is_drift && !known->words.empty()) || known->is_of(word)) return;
      Basis basis = known->basis;
      basis.factors.insert(basis.factors.begin(), keyed(Shape::kTable, covariate, keys));
      std::vector<std::string> words = known->words;
      words.push_back(word);
      std::string all = known->name.empty() ? name : name + "-and-" + known->name;
      put_in_order(all, words);
      make.add(*group, all, words,
               some(make.put(*group, basis, block.during), 0, static_cast<Eigen::Index>(keys.size())));
    };
    if (extent.has_straight && extent.has_turns) amplitudes(Covariate::kCommand, {1, 2, 3});
    if (extent.has_stop || extent.has_turns) amplitudes(Covariate::kPreviousCommand, {0, 1, 2, 3, kNoCommand});
    if (!is_drift && extent.robots.size() > 1 && extent.robots.size() <= kMostRobots)
      amplitudes(Covariate::kRobot, {extent.robots.begin(), extent.robots.end()});
    if (!is_drift) of_known_and_more(make, extent, *group, *known, block.during);
  }
}

}  // namespace kilotwin::identify
