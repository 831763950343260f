/// Fills a dictionary: columns of bases for what effects act on, and hypotheses that choose among them.
#pragma once

#include <string>
#include <vector>

#include "clients/identify/search/hypotheses.hpp"

namespace kilotwin::identify {

/// What an effect acts on.
struct Acting {
  const char* name;      ///< as names of effects begin
  const char* in_words;  ///< as result.json has it
  std::vector<Target> targets;
  std::vector<std::string> words;  ///< covariates that the target itself brings
};

inline const Acting kSpeed{"speed", "speed of the wheels", {Target::kGain}, {}};
inline const Acting kTurning{"turning", "turn rate", {Target::kTurn}, {}};
inline const Acting kSlip{"slip", "sideways slip", {Target::kSideways}, {}};
inline const Acting kWorld{"drift", "drift in the room", {Target::kWorldX, Target::kWorldY}, {"world_frame"}};
inline const Acting kCamera{
    "camera", "measured position", {Target::kMeasuredX, Target::kMeasuredY}, {"measurement"}};
/// Turn and scale of the picture, each as of one camera.
inline const Acting kPicture{
    "camera", "measured position", {Target::kMeasuredTurn, Target::kMeasuredScale}, {"measurement"}};
inline const Acting kCompass{"compass", "measured heading", {Target::kMeasuredHeading}, {"measurement"}};

/// A factor of `count` columns over a range of a covariate.
[[nodiscard]] Factor over(Factor::Shape, Covariate of, double low, double high, std::uint32_t count);
/// A factor with a column for each of some values of a covariate.
[[nodiscard]] Factor keyed(Factor::Shape, Covariate of, std::vector<double> points);
/// Waves over the place, up to an order in all.
[[nodiscard]] Factor plane(const Extent&, std::uint32_t order);

/// Columns first .. first + count - 1 of each of several bases, which are known by the places of their first columns.
[[nodiscard]] std::vector<Eigen::Index> some(const std::vector<Eigen::Index>& bases, Eigen::Index first,
                                             Eigen::Index count);

class DictionaryMaker {
 public:
  explicit DictionaryMaker(Dictionary& dictionary) : dictionary_(dictionary) {}

  /// Puts columns into the dictionary; returns the place of the first. What is measured is so whatever a robot is told.
  Eigen::Index put(Target, Basis, std::uint8_t during = kDriven);
  /// For each target the same; returns the places of their first columns.
  std::vector<Eigen::Index> put(const Acting&, const Basis&, std::uint8_t during = kDriven);

  /// A hypothesis, with `choices` hypotheses of its family (all of one name are one) tried beside it, itself counted.
  void add(const std::string& name, std::vector<std::string> covariates, const std::string& acts_on,
           std::vector<Eigen::Index> columns, double choices = 1);
  /// The same, its name being "<what it acts on>-by-<of>".
  void add(const Acting&, const std::string& of, std::vector<std::string> covariates,
           std::vector<Eigen::Index> columns, double choices = 1);
  /// The smooth curve with ever more columns, and, with `windows`, waves of one kind. Returns as put().
  std::vector<Eigen::Index> curve(const Acting&, const std::string& of, const std::vector<std::string>& covariates,
                                  const Basis&, const std::vector<Eigen::Index>& sizes, bool windows);

  /// Once, after all has been put.
  void finish();

 private:
  std::uint32_t family(const std::string& name);

  Dictionary& dictionary_;
  Eigen::Index columns_ = 0;
  std::vector<double> scales_;
};

}  // namespace kilotwin::identify
