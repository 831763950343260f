#include "services/physics/candidate_list.hpp"

#include <algorithm>

namespace kilotwin::physics {
namespace {

/// A wider skin means fewer rebuilds and longer lists. The cost is flat from 8 to 12 mm.
constexpr double kListSkin_mm = 10;
/// A list is valid while no body has moved farther, mm: half the skin less a reserve for rounding.
constexpr double kMostMotion_mm = 0.499 * kListSkin_mm;

}  // namespace

CandidateList::CandidateList(double cutoff_mm) : cells_(cutoff_mm + kListSkin_mm), first_(1, 0) {}

bool CandidateList::is_good(const Bodies& bodies) const {
  if (robot_ != bodies.robot) return false;
  const double* const x = bodies.x_mm.data();
  const double* const y = bodies.y_mm.data();
  int moved = 0;
  for (std::size_t i = 0; i < robot_.size(); ++i) {
    const double dx = x[i] - x_mm_[i], dy = y[i] - y_mm_[i];
    moved |= dx * dx + dy * dy > kMostMotion_mm * kMostMotion_mm;
  }
  return moved == 0;
}

void CandidateList::update(const Bodies& bodies) {
  if (is_good(bodies)) return;
  robot_ = bodies.robot;
  x_mm_ = bodies.x_mm;
  y_mm_ = bodies.y_mm;
  cells_.build(x_mm_, y_mm_);
  others_.clear();
  first_.resize(robot_.size() + 1);
  for (std::uint32_t i = 0; i < robot_.size(); ++i) {
    first_[i] = static_cast<std::uint32_t>(others_.size());
    const std::size_t count = cells_.find(x_mm_[i], y_mm_[i], i, found_);
    others_.insert(others_.end(), found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(count));
  }
  first_.back() = static_cast<std::uint32_t>(others_.size());
}

}  // namespace kilotwin::physics
