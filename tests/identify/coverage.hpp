/// How often 95 % intervals and bands of results hold the true values.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

/// True parameters drawn from the priors of the fit (fitter.hpp). An interval that contains what a prior leaves open holds the truth
/// often enough only if the truth varies as the prior says.
[[nodiscard]] Scene with_drawn_parameters(Scene scene, std::uint64_t seed);

/// Counts by parameter and by band.
class Coverage {
 public:
  /// The result of one set, in the folder `out`. `kind`: name of the scene in sets with an effect, else empty. Prints each interval
  /// that lacks the truth.
  void add(const std::string& kind, const Scene&, const Play&, const std::filesystem::path& out);
  /// One line per parameter and per band.
  void print() const;

  struct Share {
    int held = 0, all = 0;
  };
  /// Points of the bands of "SCENE, EFFECT FOUND", of all sets.
  [[nodiscard]] Share points_of(const std::string& band) const;
  [[nodiscard]] Share intervals_of(const std::string& parameter) const;

 private:
  void add_interval(const std::string& set, const std::string& parameter, double truth, double low, double high);
  /// The true numbers of effects: centres, instants.
  void add_numbers(const Scene&, const nlohmann::json& result);
  void add_walls(const Scene&, const nlohmann::json& result);
  std::map<std::string, std::map<std::string, Share>> intervals_;  ///< by parameter, then by set
  /// By scene and effect found: the points of each set's band.
  std::map<std::string, std::vector<Share>> bands_;
  /// By scene: sets without a band to compare. The effect found has none, or is not the only one, or acts otherwise than the truth.
  std::map<std::string, int> without_band_;
  std::map<std::string, int> without_number_;  ///< by number: sets in which no effect has it
};

}  // namespace kilotwin::truth
