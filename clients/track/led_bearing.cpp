#include "clients/track/led_bearing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/pose.hpp"

namespace kilotwin::track {
namespace {

/// The mount is learned anew when the readings have grown by this factor.
constexpr double kLearnedEvery = 1.02;
constexpr double kWindow_rad = kPi / 3;  ///< around the mode
constexpr double kAgreement = 0.6;       ///< share of the readings in the window
/// Reach of the biweight kernel, rad. Robots that slide give readings farther off than this on one side: they must not pull.
constexpr double kReach_rad = 0.26;
/// Old readings lose weight beyond this count: a camera may be turned.
constexpr double kMostWeight = 20000;

constexpr double kStraight_mm = 0.7;  ///< deviation from the chord
constexpr double kDriven_mm = 10;     ///< in the whole time

}  // namespace

LedBearing::LedBearing(std::optional<double> known_rad) : known_rad_(known_rad) {}

void LedBearing::add(double bearing_rad, double heading_rad) {
  if (total_ >= kMostWeight) {
    for (double& count : counts_) count /= 2;
    total_ /= 2;
    next_ /= 2;
  }
  const double off = wrapped(bearing_rad - heading_rad);
  const auto bin = static_cast<std::size_t>((off + kPi) / kBin_rad);
  counts_.at(std::min(bin, kBins - 1)) += 1;
  total_ += 1;
  if (total_ < next_) return;
  learned_ = learned_mount();
  next_ = kLearnedEvery * total_;
}

std::optional<LedMount> LedBearing::mount() const {
  if (known_rad_) return LedMount{*known_rad_, learned_ ? learned_->sd_rad : kRobotsDiffer_rad};
  return learned_;
}

std::optional<LedMount> LedBearing::learned_mount() const {
  // The mode: where the readings are densest by a biweight kernel.
  constexpr auto kReach = static_cast<std::size_t>(kReach_rad / kBin_rad);
  const auto weight = [](double off_rad) {
    const double u = off_rad / kReach_rad;
    return (1 - u * u) * (1 - u * u);
  };
  std::array<double, kBins> density{};
  for (std::size_t i = 0; i < kBins; ++i) {
    for (std::size_t j = 0; j <= 2 * kReach; ++j) {
      const double off = (static_cast<double>(j) - static_cast<double>(kReach)) * kBin_rad;
      density.at(i) += counts_.at((i + kBins + j - kReach) % kBins) * weight(off);
    }
  }
  const auto mode = static_cast<std::size_t>(std::max_element(density.begin(), density.end()) - density.begin());
  // Of the readings around it.
  double weights = 0, shift = 0, inside = 0;
  std::array<std::pair<double, double>, kBins> by_distance;  // count of each bin
  for (std::size_t i = 0; i < kBins; ++i) {
    const double off = wrapped(offset_of(i) - offset_of(mode));
    by_distance.at(i) = {std::abs(off), counts_.at(i)};
    if (std::abs(off) <= 0.5 * kWindow_rad) inside += counts_.at(i);
    if (std::abs(off) >= kReach_rad) continue;
    weights += counts_.at(i) * weight(off);
    shift += counts_.at(i) * weight(off) * off;
  }
  if (inside < kAgreement * total_) return std::nullopt;
  // Half of those in the window are nearer than the median distance.
  std::sort(by_distance.begin(), by_distance.end());
  double nearer = 0, median_rad = 0;
  for (const auto& [distance_rad, count] : by_distance) {
    median_rad = distance_rad;
    nearer += count;
    if (nearer >= 0.5 * inside) break;
  }
  constexpr double kSdOfMedianDistance = 1.4826;  // of a normal distribution
  return LedMount{wrapped(offset_of(mode) + shift / weights),
                  std::max(kRobotsDiffer_rad, kSdOfMedianDistance * median_rad)};
}

void StraightPath::add(double time_s, double x_mm, double y_mm) {
  if (count_ > 0 && time_s - places_[count_ - 1].time_s < kEvery_s) return;
  if (count_ > 0 && time_s - places_[count_ - 1].time_s > 2 * kEvery_s) count_ = 0;
  if (count_ == kPoints) {
    std::copy(places_ + 1, places_ + kPoints, places_);
    --count_;
  }
  places_[count_++] = {time_s, x_mm, y_mm};
}

std::optional<double> StraightPath::heading_rad() const {
  if (count_ < kPoints) return std::nullopt;
  const Place &first = places_[0], &last = places_[kPoints - 1];
  const double dx = last.x_mm - first.x_mm, dy = last.y_mm - first.y_mm, length = std::hypot(dx, dy);
  if (length < kDriven_mm) return std::nullopt;
  for (const Place& place : places_) {
    const double off = (dx * (place.y_mm - first.y_mm) - dy * (place.x_mm - first.x_mm)) / length;
    if (std::abs(off) > kStraight_mm) return std::nullopt;
  }
  return std::atan2(dy, dx);
}

}  // namespace kilotwin::track
