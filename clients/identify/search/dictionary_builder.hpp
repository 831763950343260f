/// Builds a dictionary: basis columns for each target, and hypotheses that select columns.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// A group of targets that effects act on together.
struct TargetGroup {
  const char* name;      ///< prefix of effect names
  const char* in_words;  ///< text in result.json
  std::vector<Target> targets;
  std::vector<std::string> words;  ///< covariates that the target implies
};

inline const TargetGroup kSpeed{"speed", "wheel speed", {Target::kGain}, {}};
inline const TargetGroup kTurning{"turning", "turn rate", {Target::kTurn}, {}};
inline const TargetGroup kSlip{"slip", "sideways slip", {Target::kSideways}, {}};
inline const TargetGroup kWorld{
    "drift", "drift in the world frame", {Target::kWorldX, Target::kWorldY}, {"world_frame"}};
inline const TargetGroup kCamera{
    "camera", "measured position", {Target::kMeasuredX, Target::kMeasuredY}, {"measurement"}};
/// Rotation and scale of the image, as a single camera produces them.
inline const TargetGroup kCameraPose{
    "camera", "measured position", {Target::kMeasuredTurn, Target::kMeasuredScale}, {"measurement"}};
inline const TargetGroup kCompass{"compass", "measured heading", {Target::kMeasuredHeading}, {"measurement"}};

/// Name of the effects of a group by a covariate: "drift-by-time".
[[nodiscard]] std::string effect_name(const TargetGroup&, const std::string& of);

/// A factor of `count` columns over a range of a covariate.
[[nodiscard]] Factor over(Factor::Shape, Covariate of, double low, double high, std::uint32_t count);
/// A factor with one column per point.
[[nodiscard]] Factor keyed(Factor::Shape, Covariate of, std::vector<double> points);
/// Products of cosines over x and y up to a total order.
[[nodiscard]] Factor plane(const Extent&, std::uint32_t order);

/// Columns first .. first + count - 1 of each of several bases, given by their first columns.
[[nodiscard]] std::vector<Eigen::Index> some(const std::vector<Eigen::Index>& bases, Eigen::Index first,
                                             Eigen::Index count);

class DictionaryBuilder {
 public:
  explicit DictionaryBuilder(Dictionary& dictionary) : dictionary_(dictionary) {}

  /// Adds columns to the dictionary and returns the index of the first. Measurement effects act under every
  /// command.
  Eigen::Index put(Target, Basis, std::uint8_t during = kDriven);
  /// The same for each target of a group; returns the indices of their first columns.
  std::vector<Eigen::Index> put(const TargetGroup&, const Basis&, std::uint8_t during = kDriven);

  /// Adds a hypothesis. `choices`: number of hypotheses of its family, itself included. One name is one family.
  void add(const std::string& name, std::vector<std::string> covariates, const std::string& acts_on,
           std::vector<Eigen::Index> columns, double choices = 1);
  /// The same with the name "<target>-by-<of>".
  void add(const TargetGroup&, const std::string& of, std::vector<std::string> covariates,
           std::vector<Eigen::Index> columns, double choices = 1);
  /// Hypotheses with a smooth curve of increasing order. With `windows`: also single frequencies. Returns as
  /// put().
  std::vector<Eigen::Index> curve(const TargetGroup&, const std::string& of,
                                  const std::vector<std::string>& covariates, const Basis&,
                                  const std::vector<Eigen::Index>& sizes, bool windows);

  /// To be called once, after all columns.
  void finish();

 private:
  std::uint32_t family(const std::string& name);

  Dictionary& dictionary_;
  Eigen::Index columns_ = 0;
  std::vector<double> scales_;
};

}  // namespace kilotwin::identify
