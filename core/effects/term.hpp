/// The effects of an experiment, compiled: those on motion or those on what is measured. An effect that is each wheel's own
/// becomes a term per wheel, any other one term.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/effects/covariates.hpp"
#include "core/effects/function.hpp"
#include "core/random/random.hpp"

namespace kilotwin {

struct Term {
  struct Factor {
    EffectFunction function;
    std::uint32_t first = 0, second = 0;  ///< columns of Covariates
    bool has_first = false, has_second = false;
    bool is_noise = false, is_episodes = false;
    std::optional<std::uint32_t> slot;  ///< of memory, of correlated noise and episodes
    std::uint32_t draw = 0;             ///< of independent noise
  };

  EffectSettings::Target target;
  bool left = false, right = false;   ///< which wheels, with effects on them
  double along = 1, across = 0;       ///< cosine and sine of the direction
  std::uint8_t commands = 0;          ///< bits of the MotionCommands during which it acts
  std::vector<std::uint8_t> applies;  ///< per robot; empty: to all
  std::vector<Factor> factors;
};

class TermList {
 public:
  enum class Of { kMotion, kMeasured };
  TermList(const RunPlan&, Of);

  [[nodiscard]] bool empty() const { return terms_.empty(); }
  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  [[nodiscard]] const Covariates& covariates() const { return covariates_; }
  /// About the largest size of a term's value.
  [[nodiscard]] double largest(const Term&) const;

  /// Calls take(term, values) for each term in order; values[i] belongs to robots[who[i]] and is 0 where the term does not
  /// act. See Covariates::fill for `robots` and `fields`.
  template <class Take>
  void evaluate(Tick now, const RobotColumns& robots, std::span<const std::uint32_t> who, const ArenaFields* fields,
                Take&& take) {
    covariates_.fill(now, robots, who, fields);
    for (const Term& term : terms_) {
      compute(term, now, robots, who);
      take(term, std::span<const double>(values_));
    }
  }

 private:
  void add(const EffectSettings&, std::uint32_t number, bool left, bool right, std::uint32_t wheel);
  void compute(const Term&, Tick, const RobotColumns&, std::span<const std::uint32_t> who);

  const RunPlan& plan_;
  const Of of_;
  const Random random_;
  double
      noise_per_tick_;  ///< of independent noise: what the standard deviation in a tick is, for one over a second
  Covariates covariates_;
  std::vector<Term> terms_;
  std::vector<double> values_;
};

/// Above what Random::normal can return: its argument has 52 bits, and the normal distribution has less than 2^-54 beyond.
inline constexpr double kTopNormal = 8.4;

}  // namespace kilotwin
