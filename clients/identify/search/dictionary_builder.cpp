#include "clients/identify/search/dictionary_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Natural size of a target: an effect visible to the naked eye.
double natural(Target target) {
  switch (target) {
    case Target::kGain:
    case Target::kGainLeft:
    case Target::kGainRight: return 1;
    case Target::kTurn: return 0.4;
    case Target::kOffset:
    case Target::kOffsetLeft:
    case Target::kOffsetRight:
    case Target::kAhead:
    case Target::kSideways:
    case Target::kWorldX:
    case Target::kWorldY: return 10;
    case Target::kMeasuredX:
    case Target::kMeasuredY: return 30;
    case Target::kMeasuredAhead:
    case Target::kMeasuredLeft: return 10;
    case Target::kMeasuredScale:
    case Target::kMeasuredTurn: return 0.1;
    case Target::kMeasuredHeading: return 0.3;
  }
  return 1;
}

}  // namespace

std::string effect_name(const TargetGroup& group, const std::string& of) {
  return std::string(group.name) + "-by-" + of;
}

Factor over(Shape shape, Covariate of, double low, double high, std::uint32_t count) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.low = low;
  f.high = high;
  f.count = count;
  return f;
}
Factor keyed(Shape shape, Covariate of, std::vector<double> points) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.points = std::move(points);
  return f;
}

Factor plane(const Extent& extent, std::uint32_t order) {
  Factor f = over(Shape::kCosines2, Covariate::kX, extent.x_low_mm, extent.x_high_mm, order);
  f.and_axis.of = Covariate::kY;
  f.and_low = extent.y_low_mm;
  f.and_high = extent.y_high_mm;
  return f;
}

std::vector<Eigen::Index> some(const std::vector<Eigen::Index>& bases, Eigen::Index first, Eigen::Index count) {
  std::vector<Eigen::Index> columns;
  for (const Eigen::Index base : bases)
    for (Eigen::Index i = 0; i < count; ++i) columns.push_back(base + first + i);
  return columns;
}

Eigen::Index DictionaryBuilder::put(Target target, Basis basis, std::uint8_t during) {
  const Eigen::Index first = columns_;
  const std::vector<double> rough = basis.roughness();
  for (const double r : rough) scales_.push_back(natural(target) * std::pow(r, -1.5));
  columns_ += static_cast<Eigen::Index>(rough.size());
  dictionary_.blocks.push_back({target, std::move(basis), is_measured(target) ? kAlways : during});
  return first;
}

std::vector<Eigen::Index> DictionaryBuilder::put(const TargetGroup& group, const Basis& basis,
                                                 std::uint8_t during) {
  std::vector<Eigen::Index> bases;
  for (const Target target : group.targets) bases.push_back(put(target, basis, during));
  return bases;
}

std::uint32_t DictionaryBuilder::family(const std::string& name) {
  auto& families = dictionary_.families;
  const auto known = std::find(families.begin(), families.end(), name);
  if (known != families.end()) return static_cast<std::uint32_t>(known - families.begin());
  families.push_back(name);
  return static_cast<std::uint32_t>(families.size() - 1);
}

void DictionaryBuilder::add(const std::string& name, std::vector<std::string> covariates,
                            const std::string& acts_on, std::vector<Eigen::Index> columns, double choices) {
  std::sort(columns.begin(), columns.end());
  dictionary_.hypotheses.push_back(
      {name, std::move(covariates), acts_on, std::move(columns), family(name), std::log(choices)});
}

void DictionaryBuilder::add(const TargetGroup& group, const std::string& of, std::vector<std::string> words,
                            std::vector<Eigen::Index> columns, double choices) {
  words.insert(words.begin(), group.words.begin(), group.words.end());
  add(effect_name(group, of), std::move(words), group.in_words, std::move(columns), choices);
}

std::vector<Eigen::Index> DictionaryBuilder::curve(const TargetGroup& group, const std::string& of,
                                                   const std::vector<std::string>& words, const Basis& basis,
                                                   const std::vector<Eigen::Index>& sizes, bool windows) {
  auto bases = put(group, basis);
  const auto n = static_cast<Eigen::Index>(basis.size());
  for (const Eigen::Index size : sizes)
    if (size <= n) add(group, of, words, some(bases, 0, size));
  for (Eigen::Index first = 4; windows && first + 4 <= n; first += 2)
    add(group, of, words, some(bases, first, 4), static_cast<double>(n) / 2);
  return bases;
}

void DictionaryBuilder::finish() {
  dictionary_.scale = Eigen::Map<Eigen::VectorXd>(scales_.data(), static_cast<Eigen::Index>(scales_.size()));
}

}  // namespace kilotwin::identify
