#include "clients/monitor/signatures.hpp"

#include <algorithm>

namespace kilotwin::monitor {
namespace {

using Pose3 = std::array<double, 3>;

Pose3 scaled(const Pose3& direction, double factor) {
  return {direction[0] * factor, direction[1] * factor, direction[2] * factor};
}

/// Displacement of the pose by an effect of size 1 within a step.
Pose3 push_of(std::size_t column, const Transition& step) {
  switch (column) {
    case kGainLeft: return scaled(step.per_left, step.left_mm);
    case kGainRight: return scaled(step.per_right, step.right_mm);
    case kBiasLeft: return scaled(step.per_left, step.driven_s);
    case kBiasRight: return scaled(step.per_right, step.driven_s);
    case kDriftX: return {step.time_s, 0, 0};
    case kDriftY: return {0, step.time_s, 0};
    default: return {};
  }
}

/// Change of a measurement at (x, y) by the component 0..2 of a shift: x, y, a turn about the origin.
Pose3 shift_of(std::size_t component, double x_mm, double y_mm) {
  if (component == 0) return {1, 0, 0};
  if (component == 1) return {0, 1, 0};
  return {-y_mm, x_mm, 1};
}

}  // namespace

Signatures::Signatures(std::uint32_t trackers)
    : trackers_(trackers),
      columns_(kColumns + (trackers > 1 ? 3 * std::size_t{trackers} : 0)),
      pair_of_(columns_ * columns_),
      error_(columns_),
      score_(columns_),
      shift_(columns_) {
  const auto group = [this](std::size_t first, std::size_t count) {
    for (std::size_t a = first; a < first + count; ++a) {
      for (std::size_t b = a; b < first + count; ++b) {
        pair_of_[a * columns_ + b] = pair_of_[b * columns_ + a] = pairs_.size();
        pairs_.push_back({static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)});
      }
    }
  };
  group(kGainLeft, 2);
  group(kBiasLeft, 2);
  group(kHeading, 1);
  group(kDriftX, 2);
  group(kShiftX, 3);
  for (std::size_t first = kColumns; first < columns_; first += 3) group(first, 3);
  information_.resize(pairs_.size());
  clear();
}

void Signatures::clear() {
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    clear(Family::kLasting, slot);
    clear(Family::kAbsorbed, slot);
  }
}

void Signatures::clear(Family family, std::size_t slot) {
  for (std::size_t column = 0; column < columns_; ++column) {
    if (family_of(column) != family) continue;
    for (Row& row : error_[column]) row[slot] = 0;
    score_[column][slot] = 0;
  }
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    if (family_of(pairs_[p].a) == family) information_[p][slot] = 0;
  }
}

void Signatures::forget_pose() {
  for (std::size_t column = 0; column < columns_; ++column) {
    const bool is_shift = column >= kShiftX && (column - kShiftX) % 3 < 2;
    for (Row& row : error_[column]) row.fill(0);
    // The filter follows the shifted measurement from now on.
    if (is_shift) error_[column][(column - kShiftX) % 3].fill(-1);
    if (column == kHeading) error_[column][2].fill(-1);
  }
}

void Signatures::predict(const Transition& step) {
  for (std::size_t column = 0; column < columns_; ++column) {
    const Pose3 push = push_of(column, step);
    auto& [x, y, heading, left, right] = error_[column];
    for (std::size_t s = 0; s < kSlots; ++s) {
      const double by_left = left[s] * step.left_per_bias_s, by_right = right[s] * step.right_per_bias_s;
      x[s] += step.x_heading * heading[s] + step.per_left[0] * by_left + step.per_right[0] * by_right + push[0];
      y[s] += step.y_heading * heading[s] + step.per_left[1] * by_left + step.per_right[1] * by_right + push[1];
      heading[s] += step.per_left[2] * by_left + step.per_right[2] * by_right + push[2];
    }
  }
}

void Signatures::correct(const Innovation& innovation, std::uint32_t tracker, double x_mm, double y_mm,
                         bool counts) {
  const auto& w = innovation.whitening;
  const auto& k = innovation.gain;
  for (std::size_t column = 0; column < columns_; ++column) {
    Pose3 shift{};
    if (column == kHeading) shift = {0, 0, 1};
    if (column >= kShiftX && column < kColumns) shift = shift_of(column - kShiftX, x_mm, y_mm);
    if (column >= kColumns && (column - kColumns) / 3 == tracker)
      shift = shift_of((column - kColumns) % 3, x_mm, y_mm);
    auto& [x, y, heading, left, right] = error_[column];
    auto& [along, across, turn] = shift_[column];
    Row& score = score_[column];
    for (std::size_t s = 0; s < kSlots; ++s) {
      const double rx = x[s] + shift[0], ry = y[s] + shift[1], rh = heading[s] + shift[2];
      along[s] = w[0][0] * rx + w[0][1] * ry + w[0][2] * rh;
      across[s] = w[1][0] * rx + w[1][1] * ry + w[1][2] * rh;
      turn[s] = w[2][0] * rx + w[2][1] * ry + w[2][2] * rh;
      x[s] -= k[0][0] * rx + k[0][1] * ry + k[0][2] * rh;
      y[s] -= k[1][0] * rx + k[1][1] * ry + k[1][2] * rh;
      heading[s] -= k[2][0] * rx + k[2][1] * ry + k[2][2] * rh;
      left[s] -= k[3][0] * rx + k[3][1] * ry + k[3][2] * rh;
      right[s] -= k[4][0] * rx + k[4][1] * ry + k[4][2] * rh;
    }
    if (!counts) continue;
    for (std::size_t s = 0; s < kSlots; ++s) {
      score[s] += along[s] * innovation.white[0] + across[s] * innovation.white[1] + turn[s] * innovation.white[2];
    }
  }
  if (!counts) return;
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const auto& a = shift_[pairs_[p].a];
    const auto& b = shift_[pairs_[p].b];
    for (std::size_t s = 0; s < kSlots; ++s)
      information_[p][s] += a[0][s] * b[0][s] + a[1][s] * b[1][s] + a[2][s] * b[2][s];
  }
}

void PlaceSignature::predict(const Transition& step) {
  auto& [x, y, heading, left, right] = error_;
  const Pose3 of_left = push_of(kGainLeft, step), of_right = push_of(kGainRight, step);
  const double by_left = left * step.left_per_bias_s, by_right = right * step.right_per_bias_s;
  x += step.x_heading * heading + step.per_left[0] * by_left + step.per_right[0] * by_right + of_left[0] +
       of_right[0];
  y += step.y_heading * heading + step.per_left[1] * by_left + step.per_right[1] * by_right + of_left[1] +
       of_right[1];
  heading += step.per_left[2] * by_left + step.per_right[2] * by_right + of_left[2] + of_right[2];
}

void PlaceSignature::correct(const Innovation& innovation, bool counts) {
  const std::array<double, 3> residual{error_[0], error_[1], error_[2]};
  for (std::size_t i = 0; i < 3 && counts; ++i) {
    const auto& w = innovation.whitening[i];
    const double shift = w[0] * residual[0] + w[1] * residual[1] + w[2] * residual[2];
    score_ += shift * innovation.white[i];
    information_ += shift * shift;
  }
  for (std::size_t i = 0; i < 5; ++i) {
    const auto& k = innovation.gain[i];
    error_[i] -= k[0] * residual[0] + k[1] * residual[1] + k[2] * residual[2];
  }
}

}  // namespace kilotwin::monitor
