#include "clients/monitor/places.hpp"

#include <algorithm>
#include <cmath>

#include "clients/monitor/hypotheses.hpp"

namespace kilotwin::monitor {
namespace {

constexpr double kLeastSide_mm = 60, kMostSide_mm = 150;
constexpr double kCellsAcross = 10;

Sums sums_of(const Visit& visit) { return {1, {visit.score}, {visit.information}}; }

/// Evidence without the robot whose absence lowers it most.
double robust_evidence(const Sums& all, const std::map<std::uint32_t, Sums>& robots, double dispersion) {
  double least = evidence(all, patch().prior, dispersion);
  for (const auto& [robot, own] : robots) {
    Sums rest = all;
    rest -= own;
    least = std::min(least, evidence(rest, patch().prior, dispersion));
  }
  return robots.size() < 2 ? 0 : least;
}

}  // namespace

Places::Places(double half_width_mm, double half_height_mm)
    : half_width_mm_(half_width_mm),
      half_height_mm_(half_height_mm),
      side_mm_(std::clamp(2 * std::max(half_width_mm, half_height_mm) / kCellsAcross, kLeastSide_mm, kMostSide_mm)),
      columns_(static_cast<std::uint32_t>(std::ceil(2 * half_width_mm / side_mm_))),
      rows_(static_cast<std::uint32_t>(std::ceil(2 * half_height_mm / side_mm_))) {}

std::uint32_t Places::cell_of(double x_mm, double y_mm) const {
  const auto index = [this](double offset_mm, std::uint32_t count) {
    const double at = std::clamp(offset_mm / side_mm_, 0.0, static_cast<double>(count - 1));
    return static_cast<std::uint32_t>(at);
  };
  return index(y_mm + half_height_mm_, rows_) * columns_ + index(x_mm + half_width_mm_, columns_);
}

std::optional<Places::Patch> Places::add(std::uint32_t cell, const Visit& visit, double dispersion,
                                         double threshold) {
  if (visit.to_s - visit.from_s < kShortestVisit_s || !(visit.information > 0)) return {};
  std::deque<Visit>& visits = visits_[cell];
  visits.push_front(visit);
  if (visits.size() > kMostVisits) visits.pop_back();
  // Any visit may be the first one to the patch: all prefixes of the newest visits are tested.
  Sums all{1, {}, {}};
  std::map<std::uint32_t, Sums> robots;
  Patch best;
  double weight = 0, x = 0, y = 0;
  for (const Visit& one : visits) {
    all += sums_of(one);
    robots.try_emplace(one.robot, Sums{1, {}, {}}).first->second += sums_of(one);
    weight += one.information;
    x += one.information * one.x_mm;
    y += one.information * one.y_mm;
    if (evidence_bound(all, patch().prior, dispersion) < std::max(threshold, best.evidence)) continue;
    const double found = robust_evidence(all, robots, dispersion);
    if (found <= best.evidence) continue;
    best = {found, one.from_s, x / weight, y / weight, sizes(all, patch().prior, dispersion)[0], {}};
    for (const auto& [robot, own] : robots) best.robots.push_back(robot);
  }
  if (best.evidence < threshold) return {};
  known_.push_back({best.x_mm, best.y_mm});
  visits.clear();
  return best;
}

bool Places::is_known(double x_mm, double y_mm, double reach) const {
  return std::any_of(known_.begin(), known_.end(), [&](const Known& patch) {
    return std::hypot(patch.x_mm - x_mm, patch.y_mm - y_mm) < reach * side_mm_;
  });
}

std::optional<Places::Patch> Places::add_alarm(const Visit& visit, double dispersion) {
  Sums all = sums_of(visit);
  Patch found{0, visit.from_s, visit.x_mm, visit.y_mm, {}, {visit.robot}};
  for (const Visit& other : alarms_) {
    const bool is_near = std::hypot(other.x_mm - visit.x_mm, other.y_mm - visit.y_mm) < side_mm_;
    const bool is_known_robot =
        std::find(found.robots.begin(), found.robots.end(), other.robot) != found.robots.end();
    if (!is_near || is_known_robot || (other.score < 0) != (visit.score < 0)) continue;
    all += sums_of(other);
    found.onset_s = std::min(found.onset_s, other.from_s);
    found.x_mm += other.x_mm;
    found.y_mm += other.y_mm;
    found.robots.push_back(other.robot);
  }
  alarms_.push_front(visit);
  if (alarms_.size() > kMostVisits) alarms_.pop_back();
  if (found.robots.size() < 2) return {};
  found.x_mm /= static_cast<double>(found.robots.size());
  found.y_mm /= static_cast<double>(found.robots.size());
  std::sort(found.robots.begin(), found.robots.end());
  found.evidence = evidence(all, patch().prior, dispersion);
  found.size = sizes(all, patch().prior, dispersion)[0];
  known_.push_back({found.x_mm, found.y_mm});
  known_.push_back({visit.x_mm, visit.y_mm});
  return found;
}

}  // namespace kilotwin::monitor
