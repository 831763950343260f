/// The compiled effects of an experiment, on motion or on measurement. An effect that applies to each wheel by itself becomes
/// one term per wheel; any other effect becomes one term.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
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
    std::optional<std::uint32_t> slot;  ///< of the memory, for correlated noise and episodes
    std::uint32_t draw = 0;             ///< draw index of independent noise
  };

  EffectSettings::Target target;
  bool left = false, right = false;   ///< for effects on wheels: which ones
  double along = 1, across = 0;       ///< cosine and sine of the direction
  std::uint8_t commands = 0;          ///< bits of the MotionCommands during which the term acts
  std::vector<std::uint8_t> applies;  ///< per robot; empty: to all
  std::optional<std::uint32_t> sum;   ///< for gains that are added before they act: index of their sum, from 0
  std::vector<Factor> factors;
};

class TermList {
 public:
  enum class Of { kMotion, kMeasured };
  TermList(const RunPlan&, Of);

  [[nodiscard]] bool empty() const { return terms_.empty(); }
  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  [[nodiscard]] const Covariates& covariates() const { return covariates_; }
  /// Number of sums of gains.
  [[nodiscard]] std::size_t sums() const { return sum_names_.size(); }
  /// Approximate maximum of a term's magnitude.
  [[nodiscard]] double largest(const Term&) const;

  /// Calls take(term, values) for each term in order. values[i] belongs to robots[who[i]]; it is 0 where the term does not
  /// act. Covariates::fill explains `robots` and `fields`.
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
      noise_per_tick_;  ///< independent noise: standard deviation in a tick over that of the mean over one second
  Covariates covariates_;
  std::vector<Term> terms_;
  std::vector<std::string> sum_names_;
  std::vector<double> values_;
};

/// Exceeds any value of Random::normal: its argument has 52 bits, and the normal tail beyond is less than 2^-54.
inline constexpr double kTopNormal = 8.4;

}  // namespace kilotwin
