#include "clients/track/led_sources.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// Kilobots carry their LED so far from the disc's centre, radii: 14.9 mm of 16.5 mm. Source: the body model of gym-kilobots.
constexpr double kLedAt = 0.9;
/// Places of an LED that are tried, per turn.
constexpr int kBearings = 45;
/// Falloff of an LED's light: a Gaussian picture and an exponential glow, radii; the glow's share; where the light ends.
constexpr double kPicture = 0.2, kGlow = 0.35, kGlowShare = 0.25, kFalloffReach = 0.8;
/// A source is weaker than this, relative to the floor, where the LED is dark. A neighbour's falloff is known no better than
/// to this share of its light.
constexpr double kLeastSource = 0.12, kUnknown = 0.35;
/// Sources closer than this, radii, are moved together.
constexpr double kClose = 0.8;
constexpr int kRounds = 3;
/// Share that is added to the squares of each source, as sources in nearly the same place cannot be separated.
constexpr double kRidge = 0.02;
/// Sources that are fitted together at most: discs that touch a disc are six.
constexpr std::size_t kMostSources = 12;

double falloff(double radii) {
  if (radii >= kFalloffReach) return 0;
  const double fade = 1 - radii / kFalloffReach;
  return (1 - kGlowShare) * std::exp(-0.5 * radii * radii / (kPicture * kPicture)) +
         kGlowShare * std::exp(-radii / kGlow) * std::min(1.0, 3 * fade);
}

/// falloff() by the squared distance: a table, linear between its entries.
class Falloffs {
 public:
  static const Falloffs& get() {
    static const Falloffs falloffs;
    return falloffs;
  }
  /// 0 <= radii2 <= kFalloffReach^2, and rounding.
  [[nodiscard]] double at(double radii2) const {
    const double place = radii2 * kPerSquare;
    const int whole = static_cast<int>(place);
    const double* const entry = table_.data() + whole;
    return entry[0] + (place - whole) * (entry[1] - entry[0]);
  }

 private:
  static constexpr std::size_t kEntries = 2048;
  static constexpr double kPerSquare = kEntries / (kFalloffReach * kFalloffReach);
  Falloffs() {
    for (std::size_t i = 0; i < table_.size(); ++i)
      table_[i] = falloff(std::sqrt(static_cast<double>(i) / kPerSquare));
  }
  std::array<double, kEntries + 2> table_;
};

/// Scalar products of two falloffs by the distance of their sources, in squared radii: a table.
class Overlaps {
 public:
  static const Overlaps& get() {
    static const Overlaps overlaps;
    return overlaps;
  }
  [[nodiscard]] double at(double radii) const {
    const double place = radii * kPerRadius;
    const auto i = static_cast<std::size_t>(place);
    if (i + 1 >= table_.size()) return 0;
    const double share = place - static_cast<double>(i);
    return (1 - share) * table_[i] + share * table_[i + 1];
  }

 private:
  static constexpr int kPerRadius = 32;
  Overlaps() : table_(static_cast<std::size_t>(2 * kFalloffReach * kPerRadius) + 2) {
    constexpr double kStep = 0.04;
    constexpr int kSteps = static_cast<int>(2 * kFalloffReach / kStep + 0.999);
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const double apart = static_cast<double>(i) / kPerRadius;
      for (int row = 0; row < kSteps; ++row) {
        const double y = -kFalloffReach + row * kStep;
        for (int column = 0; column < kSteps; ++column) {
          const double x = -kFalloffReach + column * kStep;
          table_[i] += kStep * kStep * falloff(std::hypot(x, y)) * falloff(std::hypot(x - apart, y));
        }
      }
    }
  }
  std::vector<double> table_;
};

/// Light as a vector: two differences of the channels, whose direction is the hue, and light without a hue.
using Tint = Eigen::RowVector3d;
constexpr double kRoot3_2 = 0.8660254037844386;

Tint tint_of(const Light& light, std::size_t i) {
  const Colour& c = light.relative[i];
  const auto [least, most] = std::minmax({c[0], c[1], c[2]});
  const double chroma = most - least;
  if (light.clipped[i] || chroma <= kLeastChroma) return {0, 0, light.anyones[i]};
  const double share = (chroma - kLeastChroma) / chroma * std::min(1.0, most / 0.5);
  return {share * (c[0] - 0.5 * (c[1] + c[2])), share * kRoot3_2 * (c[1] - c[2]), 0};
}

/// The light with that hue, less its dimmest channel.
Colour colour_of(const Tint& tint) {
  const double x = tint(0), y = tint(1) / kRoot3_2;  // R - (G + B) / 2, G - B
  Colour colour{2.0 / 3 * x, -x / 3 + 0.5 * y, -x / 3 - 0.5 * y};
  const double dimmest = std::min({colour[0], colour[1], colour[2]});
  for (double& channel : colour) channel -= dimmest;
  return colour;
}

/// A place where a robot's LED may be. Radii, from the middle of the own disc.
struct Place {
  double x, y, bearing_rad;
  Tint matched = Tint::Zero();  ///< scalar product of its falloff and the light
};
double apart(const Place& a, const Place& b) { return std::sqrt(squared(a.x - b.x) + squared(a.y - b.y)); }

/// Scalar product of the falloffs of two sources, squared radii.
double overlap(const Place& a, const Place& b) { return Overlaps::get().at(apart(a, b)); }
double own_overlap() { return Overlaps::get().at(0); }

/// The least squares fit of some sources, as a Cholesky factor of its normal equations. The explained part of a further source costs
/// one triangular solve.
class Fit {
 public:
  explicit Fit(double pixels) : pixels_(pixels) {}

  /// The part of a further source that those of the fit leave.
  struct Rest {
    const Place* place;
    std::array<double, kMostSources> solved;  ///< its products with the sources, divided by the factor
    Tint light;                               ///< the light that it matches
    double square;                            ///< its product with itself
    [[nodiscard]] double gain() const { return light.squaredNorm() / square; }
  };
  [[nodiscard]] Rest rest_of(const Place& place) const {
    Rest rest{&place, {}, place.matched, pixels_ * own_overlap() * (1 + kRidge)};
    for (std::size_t i = 0; i < count_; ++i) {
      double left = pixels_ * overlap(place, *sources_[i].place);
      for (std::size_t j = 0; j < i; ++j) left -= sources_[i].solved[j] * rest.solved[j];
      rest.solved[i] = left / diagonal_[i];
      rest.light -= rest.solved[i] * light_[i];
      rest.square -= rest.solved[i] * rest.solved[i];
    }
    return rest;
  }
  void add(const Place& place) {
    sources_[count_] = rest_of(place);
    diagonal_[count_] = std::sqrt(sources_[count_].square);
    light_[count_] = sources_[count_].light / diagonal_[count_];
    gain_ += sources_[count_].gain();
    ++count_;
  }
  /// Squares that the sources explain; with a further one; with two.
  [[nodiscard]] double gain() const { return gain_; }
  [[nodiscard]] double gain_with(const Place& place) const { return gain_ + rest_of(place).gain(); }
  [[nodiscard]] double gain_with(const Rest& a, const Rest& b) const {
    double product = pixels_ * overlap(*a.place, *b.place);
    for (std::size_t i = 0; i < count_; ++i) product -= a.solved[i] * b.solved[i];
    const double share = product / a.square;
    return gain_ + a.gain() + (b.light - share * a.light).squaredNorm() / (b.square - share * product);
  }
  /// The light of each source, in the order in which they were added.
  [[nodiscard]] std::vector<Tint> light() const {
    std::vector<Tint> light(light_.begin(), light_.begin() + static_cast<std::ptrdiff_t>(count_));
    for (std::size_t i = count_; i-- > 0;) {
      for (std::size_t j = i + 1; j < count_; ++j) light[i] -= sources_[j].solved[i] * light[j];
      light[i] /= diagonal_[i];
    }
    return light;
  }

 private:
  double pixels_;  ///< of the grid per squared radius
  double gain_ = 0;
  std::size_t count_ = 0;
  std::array<Rest, kMostSources> sources_;
  std::array<double, kMostSources> diagonal_;
  std::array<Tint, kMostSources> light_;
};

/// The bearings that are tried.
struct Direction {
  double bearing_rad, cos, sin;
};
const std::array<Direction, kBearings>& directions() {
  static const std::array<Direction, kBearings> table = [] {
    std::array<Direction, kBearings> made{};
    for (std::size_t i = 0; i < kBearings; ++i) {
      const double bearing_rad = 2 * kPi * static_cast<double>(i) / kBearings;
      made[i] = {bearing_rad, std::cos(bearing_rad), std::sin(bearing_rad)};
    }
    return made;
  }();
  return table;
}

class Sources {
 public:
  Sources(const Light& light, const Circle& disc, const std::vector<Circle>& near) : disc_(disc) {
    const double per_radius = disc.radius_px / light.stride;
    pixels_ = per_radius * per_radius;
    add_robot(0, 0, 1);
    for (const Circle& other : near) {
      if (places_.size() == kMostSources) break;
      add_robot((other.centre.x_px - disc.centre.x_px) / disc.radius_px,
                (other.centre.y_px - disc.centre.y_px) / disc.radius_px, other.radius_px / disc.radius_px);
    }
    match(light, disc);
    chosen_.assign(places_.size(), nullptr);
  }

  void solve() {
    const std::vector<std::size_t> order = strongest_first();
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<const Place*> before = chosen_;
      for (const std::size_t robot : order) choose(robot);
      for (std::size_t other = 1; other < places_.size(); ++other) choose_together(other);
      if (chosen_ == before) break;
    }
  }

  [[nodiscard]] std::optional<LedSource> own() const {
    if (chosen_[0] == nullptr) return std::nullopt;
    const std::vector<Tint> light = fit_without(kMostSources).light();
    LedSource source;
    double least = kLeastSource;
    std::size_t i = 0;
    for (std::size_t robot = 1; robot < chosen_.size(); ++robot) {
      if (chosen_[robot] == nullptr) continue;
      source.others.push_back(pixel(chosen_[robot]->x, chosen_[robot]->y));
      least += kUnknown * light[++i].norm() * overlap(*chosen_[0], *chosen_[robot]) / own_overlap();
    }
    if (light[0].norm() < least) return std::nullopt;
    const double bearing_rad = refined_bearing();
    source.at = pixel(kLedAt * std::cos(bearing_rad), -kLedAt * std::sin(bearing_rad));
    source.colour = colour_of(light[0]);
    source.white = std::max(0.0, light[0](2));
    return source;
  }

 private:
  void add_robot(double x, double y, double radius) {
    std::vector<Place>& ring = places_.emplace_back();
    for (const Direction& to : directions()) {
      const double at_x = x + kLedAt * radius * to.cos, at_y = y - kLedAt * radius * to.sin;
      if (squared(at_x) + squared(at_y) < squared(kLedAt + kClose)) ring.push_back({at_x, at_y, to.bearing_rad});
    }
  }

  /// A pixel with light, its column in the grid.
  struct Lit {
    int column;
    double u, v, white;  ///< Tint
  };

  void match(const Light& light, const Circle& disc) {
    std::vector<Lit> lit;
    std::vector<std::size_t> rows{0};  // where the pixels of each row begin
    for (int row = 0; row < light.rows; ++row) {
      for (int column = 0; column < light.columns; ++column) {
        const std::size_t i = light.index(column, row);
        if (light.anyones[i] <= 0) continue;
        const Tint tint = tint_of(light, i);
        lit.push_back({column, tint(0), tint(1), tint(2)});
      }
      rows.push_back(lit.size());
    }
    const double step = light.stride / disc.radius_px;  // between two pixels of the grid, radii
    const double left = (light.left - disc.centre.x_px) / disc.radius_px,
                 top = (light.top - disc.centre.y_px) / disc.radius_px;
    for (std::vector<Place>& ring : places_) {
      for (Place& place : ring)
        place.matched = matched_at((place.x - left) / step, (place.y - top) / step, step, lit, rows);
    }
  }

  /// Scalar product of the light and the falloff of a source at a column and a row of the grid.
  static Tint matched_at(double column, double row, double step, const std::vector<Lit>& lit,
                         const std::vector<std::size_t>& rows) {
    const Falloffs& falloffs = Falloffs::get();
    const double reach = kFalloffReach / step, reach2 = reach * reach, step2 = step * step;
    const int first = std::max(0, static_cast<int>(std::ceil(row - reach)));
    const int last = std::min(static_cast<int>(rows.size()) - 2, static_cast<int>(std::floor(row + reach)));
    double u = 0, v = 0, white = 0;
    for (int y = first; y <= last; ++y) {
      const double down2 = squared(y - row);
      const Lit* const end = lit.data() + rows[static_cast<std::size_t>(y) + 1];
      for (const Lit* pixel = lit.data() + rows[static_cast<std::size_t>(y)]; pixel != end; ++pixel) {
        const double apart2 = squared(pixel->column - column) + down2;
        if (apart2 >= reach2) continue;
        const double share = falloffs.at(step2 * apart2);
        u += share * pixel->u;
        v += share * pixel->v;
        white += share * pixel->white;
      }
    }
    return {u, v, white};
  }

  /// The fit of all chosen sources but those of two robots.
  [[nodiscard]] Fit fit_without(std::size_t robot, std::size_t another = kMostSources) const {
    Fit fit(pixels_);
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (i != robot && i != another && chosen_[i] != nullptr) fit.add(*chosen_[i]);
    }
    return fit;
  }

  /// Robots by their light: the strongest source explains what it can before others are placed.
  [[nodiscard]] std::vector<std::size_t> strongest_first() const {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      double most = 0;
      for (const Place& place : places_[i]) most = std::max(most, place.matched.squaredNorm());
      order.emplace_back(-most, i);
    }
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> robots;
    robots.reserve(order.size());
    for (const auto& [light, robot] : order) robots.push_back(robot);
    return robots;
  }

  /// The best place for a robot's source, with all others where they are.
  void choose(std::size_t robot) {
    const Fit fit = fit_without(robot);
    double most = fit.gain() + kLeastSource * kLeastSource * pixels_ * own_overlap();
    chosen_[robot] = nullptr;
    for (const Place& place : places_[robot]) {
      if (place.matched.isZero()) continue;
      const double with = fit.gain_with(place);
      if (!(with > most)) continue;  // nor where it is no number
      most = with;
      chosen_[robot] = &place;
    }
  }

  /// The best places for the own source and another one that is close.
  void choose_together(std::size_t other) {
    const Place *own = chosen_[0], *its = chosen_[other];
    if (own == nullptr || its == nullptr || apart(*own, *its) > kClose) return;
    const Fit fit = fit_without(0, other);
    const auto rests = [&](std::size_t robot, const Place& around) {
      std::vector<Fit::Rest> found;
      for (const Place& place : places_[robot]) {
        if (apart(place, around) <= kClose) found.push_back(fit.rest_of(place));
      }
      return found;
    };
    double most = fit.gain_with(fit.rest_of(*own), fit.rest_of(*its));
    const std::vector<Fit::Rest> its_rests = rests(other, *its);
    for (const Fit::Rest& a : rests(0, *own)) {
      for (const Fit::Rest& b : its_rests) {
        const double with = fit.gain_with(a, b);
        if (!(with > most)) continue;  // nor where it is no number
        most = with;
        chosen_[0] = a.place;
        chosen_[other] = b.place;
      }
    }
  }

  /// The vertex of a parabola through the gains of the own place and those beside it.
  [[nodiscard]] double refined_bearing() const {
    const Fit others = fit_without(0);
    const auto at = static_cast<std::size_t>(chosen_[0] - places_[0].data());
    const auto gain_of = [&](std::size_t i) { return others.gain_with(places_[0][i % places_[0].size()]); };
    const double before = gain_of(at + places_[0].size() - 1), here = gain_of(at), after = gain_of(at + 1);
    const double bend = before - 2 * here + after;
    const double shift = bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
    return wrapped(chosen_[0]->bearing_rad + shift * 2 * kPi / kBearings);
  }

  [[nodiscard]] Point pixel(double x, double y) const {
    return {disc_.centre.x_px + x * disc_.radius_px, disc_.centre.y_px + y * disc_.radius_px};
  }

  Circle disc_;
  double pixels_;                           ///< of the grid per squared radius
  std::vector<std::vector<Place>> places_;  ///< by robot, the own one first
  std::vector<const Place*> chosen_;        ///< by robot; none: dark
};

}  // namespace

std::optional<LedSource> own_source(const Light& light, const Circle& disc, const std::vector<Circle>& near) {
  Sources sources(light, disc, near);
  sources.solve();
  return sources.own();
}

}  // namespace kilotwin::track
