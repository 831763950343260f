#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

/// Columns of a compass that varies, and its mean: a constant error looks like a slip of all robots.
void add_compass(DictionaryBuilder& make, const char* of, const std::vector<Eigen::Index>& bases,
                 const std::vector<Eigen::Index>& sizes) {
  const auto constant = make.put(kCompass, Basis{});
  for (const Eigen::Index size : sizes) {
    std::vector<Eigen::Index> columns = some(bases, 0, size);
    columns.insert(columns.end(), constant.begin(), constant.end());
    make.add(kCompass, of, {of}, columns);
  }
}

}  // namespace

std::vector<Eigen::Index> add_time_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const auto smooth = [&](std::uint32_t count) {
    return Basis{{over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, count)}};
  };
  make.curve(kSpeed, "time", {"time"}, smooth(32), {1, 3, 8, 16, 32}, true);
  make.curve(kTurning, "time", {"time"}, smooth(12), {1, 3, 12}, true);
  // A slip has no constant elsewhere.
  Basis slipping = smooth(8);
  slipping.factors.front().first = 0;
  make.curve(kSlip, "time", {"time"}, slipping, {2, 4, 8}, false);
  auto drift = make.curve(kWorld, "time", {"time"}, smooth(32), {1, 3, 8, 16, 32}, true);
  // The camera may drift, rotate and change its scale, separately or together.
  const auto aside = make.put(kCamera, smooth(16));
  const auto turned = make.put(kCameraPose, smooth(8));
  for (const Eigen::Index n : {1, 3, 8, 16}) make.add(kCamera, "time", {"time"}, some(aside, 0, n));
  for (const Eigen::Index n : {1, 3, 8}) {
    auto all = some(turned, 0, n);
    for (const Eigen::Index base : turned) make.add(kCamera, "time", {"time"}, some({base}, 0, n));
    for (const Eigen::Index c : some(aside, 0, n)) all.push_back(c);
    make.add(kCamera, "time", {"time"}, all);
  }
  if (extent.headings)
    add_compass(make, "time", make.curve(kCompass, "time", {"time"}, smooth(6), {1, 3, 6}, false), {1, 3, 6});
  // Steps, and pulses between two steps.
  constexpr int kSteps = 40;
  std::vector<double> at;
  for (int i = 1; i < kSteps; ++i) at.push_back(extent.duration_s * i / kSteps);
  Factor at_least = keyed(Shape::kAtLeast, Covariate::kTime, at);
  at_least.high = extent.duration_s;
  const Basis steps{{at_least}};
  const auto n = static_cast<Eigen::Index>(at.size());
  for (const TargetGroup* group : {&kSpeed, &kWorld}) {
    const auto bases = make.put(*group, steps);
    for (Eigen::Index i = 0; i < n; ++i) make.add(*group, "time", {"time"}, some(bases, i, 1), kSteps);
    for (Eigen::Index width : {1, 2, 4, 8, 16}) {
      for (Eigen::Index i = 0; i + width < n; ++i) {
        auto columns = some(bases, i, 1);
        for (const Eigen::Index c : some(bases, i + width, 1)) columns.push_back(c);
        make.add(*group, "time", {"time"}, columns, kSteps * 5.0);
      }
    }
    make.add(*group, "time", {"time"}, some(bases, 0, n));
  }
  return drift;
}

std::vector<Eigen::Index> add_place_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const auto map = [&](const TargetGroup& group, std::uint32_t order) {
    auto bases = make.put(group, Basis{{plane(extent, order)}});
    for (std::uint32_t o = 1; o <= order; ++o)
      make.add(group, "position", {"position"}, some(bases, 0, (o + 1) * (o + 2) / 2 - 1));
    return bases;
  };
  map(kSpeed, 8);
  map(kTurning, 3);
  Factor slipping = plane(extent, 3);
  slipping.first = 0;
  const auto slip = make.put(kSlip, Basis{{slipping}});
  for (const Eigen::Index order : {1, 2, 3})
    make.add(kSlip, "position", {"position"}, some(slip, 0, (order + 1) * (order + 2) / 2));
  auto drift = map(kWorld, 5);
  map(kCamera, 5);
  // Lenses and tilts distort most at the border, where cosines are flat: polynomials. Their range may exceed the
  // visited area.
  Factor bent = plane(extent, 5);
  bent.shape = Shape::kPolynomials2;
  const double beyond_x = 0.15 * (bent.high - bent.low), beyond_y = 0.15 * (bent.and_high - bent.and_low);
  bent.low -= beyond_x;
  bent.high += beyond_x;
  bent.and_low -= beyond_y;
  bent.and_high += beyond_y;
  const auto lens = make.put(kCamera, Basis{{bent}});
  for (Eigen::Index o = 1; o <= 5; ++o)
    make.add(kCamera, "position", {"position"}, some(lens, 0, (o + 1) * (o + 2) / 2 - 1));
  if (extent.headings) add_compass(make, "position", map(kCompass, 4), {2, 5, 9, 14});
  // Stripes finer than the maps resolve: mosaic seams, floor boards.
  const auto stripes = [&](const TargetGroup& group, Covariate of, double low, double high, std::uint32_t count) {
    const auto bases = make.put(group, Basis{{over(Shape::kCosines, of, low, high, count)}});
    for (Eigen::Index size = count / 2; size <= count; size += count / 2)
      make.add(group, "position", {"position"}, some(bases, 0, size));
  };
  for (const auto& [group, count] : {std::pair{&kCamera, 24u}, {&kSpeed, 16u}}) {
    stripes(*group, Covariate::kX, extent.x_low_mm, extent.x_high_mm, count);
    stripes(*group, Covariate::kY, extent.y_low_mm, extent.y_high_mm, count);
  }
  return drift;
}

void add_heading_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  const Basis round{{over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 4)}};
  make.curve(kSpeed, "heading", {"heading"}, round, {2, 4, 8}, false);
  make.curve(kTurning, "heading", {"heading"}, round, {2, 4, 8}, false);
  make.curve(kSlip, "heading", {"heading"}, round, {2, 4}, false);
  // A tall marker that is lit from one side, or one that is not round.
  make.curve(kCamera, "heading", {"heading"}, round, {2, 4}, false);
  if (extent.headings)
    add_compass(make, "heading", make.curve(kCompass, "heading", {"heading"}, round, {2, 4}, false), {2, 4});
}

void add_drift_hypotheses(DictionaryBuilder& make, const Extent& extent, const std::vector<Eigen::Index>& in_time,
                          const std::vector<Eigen::Index>& in_place) {
  const auto constant = make.put(kWorld, Basis{});
  make.add("drift", {"world_frame"}, kWorld.in_words, some(constant, 0, 1));
  // A drift that varies also has a mean.
  const auto and_constant = [&](std::vector<Eigen::Index> columns) {
    for (const Eigen::Index c : constant) columns.push_back(c);
    return columns;
  };
  for (const Eigen::Index size : {1, 3, 8})
    make.add(kWorld, "time", {"time"}, and_constant(some(in_time, 0, size)));
  for (const Eigen::Index order : {1, 2, 3})
    make.add(kWorld, "position", {"position"}, and_constant(some(in_place, 0, (order + 1) * (order + 2) / 2 - 1)));
  if (extent.has_stop) {
    const auto at_rest = make.put(kWorld, Basis{}, 1);
    make.add("drift-at-rest", {"world_frame"}, kWorld.in_words, some(at_rest, 0, 1));
    auto both = some(constant, 0, 1);
    for (const auto c : some(at_rest, 0, 1)) both.push_back(c);
    make.add("drift", {"world_frame"}, kWorld.in_words, both);
  }
}

}  // namespace kilotwin::identify
