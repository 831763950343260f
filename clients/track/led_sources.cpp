#include "clients/track/led_sources.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
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

double falloff(double radii) {
  if (radii >= kFalloffReach) return 0;
  const double fade = 1 - radii / kFalloffReach;
  return (1 - kGlowShare) * std::exp(-0.5 * radii * radii / (kPicture * kPicture)) +
         kGlowShare * std::exp(-radii / kGlow) * std::min(1.0, 3 * fade);
}

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
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const double apart = static_cast<double>(i) / kPerRadius;
      for (double y = -kFalloffReach; y < kFalloffReach; y += kStep) {
        for (double x = -kFalloffReach; x < kFalloffReach; x += kStep)
          table_[i] += kStep * kStep * falloff(std::hypot(x, y)) * falloff(std::hypot(x - apart, y));
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
double apart(const Place& a, const Place& b) { return std::hypot(a.x - b.x, a.y - b.y); }

class Sources {
 public:
  Sources(const Light& light, const Circle& disc, const std::vector<Circle>& near) : disc_(disc) {
    const double per_radius = disc.radius_px / light.stride;
    pixels_ = per_radius * per_radius;
    add_robot(0, 0, 1);
    for (const Circle& other : near)
      add_robot((other.centre.x_px - disc.centre.x_px) / disc.radius_px,
                (other.centre.y_px - disc.centre.y_px) / disc.radius_px, other.radius_px / disc.radius_px);
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
    const Fit fit = fitted();
    const Eigen::MatrixX3d& light = fit.light;
    const std::vector<const Place*>& places = fit.places;
    double least = kLeastSource;
    for (Eigen::Index i = 1; i < light.rows(); ++i)
      least += kUnknown * light.row(i).norm() *
               Overlaps::get().at(apart(*places[0], *places[static_cast<std::size_t>(i)])) / Overlaps::get().at(0);
    if (light.row(0).norm() < least) return std::nullopt;
    LedSource source;
    const double bearing_rad = refined_bearing();
    source.at = pixel(kLedAt * std::cos(bearing_rad), -kLedAt * std::sin(bearing_rad));
    for (std::size_t i = 1; i < places.size(); ++i) source.others.push_back(pixel(places[i]->x, places[i]->y));
    source.colour = colour_of(light.row(0));
    source.white = std::max(0.0, light(0, 2));
    return source;
  }

 private:
  void add_robot(double x, double y, double radius) {
    std::vector<Place>& ring = places_.emplace_back();
    for (int i = 0; i < kBearings; ++i) {
      const double bearing = 2 * kPi * i / kBearings;
      const double at_x = x + kLedAt * radius * std::cos(bearing), at_y = y - kLedAt * radius * std::sin(bearing);
      if (std::hypot(at_x, at_y) < kLedAt + kClose) ring.push_back({at_x, at_y, bearing});
    }
  }

  void match(const Light& light, const Circle& disc) {
    for (int row = 0; row < light.rows; ++row) {
      for (int column = 0; column < light.columns; ++column) {
        const std::size_t i = light.index(column, row);
        if (light.anyones[i] <= 0) continue;
        const Tint tint = tint_of(light, i);
        const double x = (light.left + column * light.stride - disc.centre.x_px) / disc.radius_px;
        const double y = (light.top + row * light.stride - disc.centre.y_px) / disc.radius_px;
        for (std::vector<Place>& ring : places_) {
          for (Place& place : ring) place.matched += falloff(std::hypot(place.x - x, place.y - y)) * tint;
        }
      }
    }
  }

  struct Fit {
    std::vector<const Place*> places;  ///< of the chosen sources; the own one first, if it is chosen
    Eigen::MatrixX3d light;            ///< of each source
    double gain = 0;                   ///< squares that the sources explain
  };
  /// All chosen sources together, by least squares.
  [[nodiscard]] Fit fitted() const {
    Fit fit;
    std::copy_if(chosen_.begin(), chosen_.end(), std::back_inserter(fit.places),
                 [](const Place* place) { return place != nullptr; });
    const auto count = static_cast<Eigen::Index>(fit.places.size());
    Eigen::MatrixXd products(count, count);
    Eigen::MatrixX3d matched(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Place& a = *fit.places[static_cast<std::size_t>(i)];
      matched.row(i) = a.matched;
      for (Eigen::Index j = 0; j <= i; ++j)
        products(i, j) = products(j, i) =
            pixels_ * Overlaps::get().at(apart(a, *fit.places[static_cast<std::size_t>(j)]));
      products(i, i) *= 1 + kRidge;
    }
    fit.light = products.llt().solve(matched);
    fit.gain = fit.light.cwiseProduct(matched).sum();
    return fit;
  }
  [[nodiscard]] double gain() const { return fitted().gain; }

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
    for (const auto& [light, robot] : order) robots.push_back(robot);
    return robots;
  }

  /// The best place for a robot's source, with all others where they are.
  void choose(std::size_t robot) {
    chosen_[robot] = nullptr;
    double most = gain() + kLeastSource * kLeastSource * pixels_ * Overlaps::get().at(0);
    const Place* best = nullptr;
    for (const Place& place : places_[robot]) {
      if (place.matched.isZero()) continue;
      chosen_[robot] = &place;
      const double with = gain();
      if (!(with > most)) continue;  // nor where it is no number
      most = with;
      best = &place;
    }
    chosen_[robot] = best;
  }

  /// The best places for the own source and another one that is close.
  void choose_together(std::size_t other) {
    const Place *own = chosen_[0], *its = chosen_[other];
    if (own == nullptr || its == nullptr || apart(*own, *its) > kClose) return;
    double most = gain();
    const Place *best_own = own, *best_its = its;
    for (const Place& a : places_[0]) {
      if (apart(a, *own) > kClose) continue;
      chosen_[0] = &a;
      for (const Place& b : places_[other]) {
        if (apart(b, *its) > kClose) continue;
        chosen_[other] = &b;
        const double with = gain();
        if (!(with > most)) continue;  // nor where it is no number
        most = with;
        best_own = &a;
        best_its = &b;
      }
    }
    chosen_[0] = best_own;
    chosen_[other] = best_its;
  }

  /// The vertex of a parabola through the gains of the own place and those beside it.
  [[nodiscard]] double refined_bearing() const {
    Sources trial = *this;
    const auto at = static_cast<std::size_t>(chosen_[0] - places_[0].data());
    const auto gain_of = [&](std::size_t i) {
      trial.chosen_ = chosen_;
      trial.chosen_[0] = &places_[0][i % places_[0].size()];
      return trial.gain();
    };
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
