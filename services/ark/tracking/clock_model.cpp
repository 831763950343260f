#include "services/ark/tracking/clock_model.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace kilotwin::ark {
namespace {

constexpr double kWindow_s = 120, kBucket_s = 1;
/// Frames with lower numbers than the last one are late if they are near it; otherwise the source has restarted its numbering.
constexpr std::uint64_t kReordered = 16;
/// After so much time the line is trusted, and a sample that arrives so much too early, or too late, contradicts it.
constexpr double kTrusted_s = 5, kTooEarly_ns = -20e6, kTooLate_ns = 1e9;
/// So many contradictions in a row that agree with each other are a clock that was set. Queues delay, too: samples that are
/// late by little are used meanwhile.
constexpr std::uint32_t kAgree = 3, kLateAgree = 30;
constexpr double kAgreement_ns = 2e6, kLate_ns = 50e6;
/// Oscillators of computers and cameras lie far below.
constexpr double kMostDrift = 1e-3;
/// How long samples that show UTC may take, and by how much the two clocks may differ.
constexpr std::int64_t kUtcSlowest_ns = 1'000'000'000, kUtcSlack_ns = 5'000'000;

}  // namespace

void ClockModel::start(std::int64_t source_ns, std::int64_t arrival_ns) {
  any_ = true;
  base_ns_ = source_ns;
  first_ns_ = arrival_ns - source_ns;
  points_.clear();
  at_ = {0, 0};
  slope_ = 0;
  suspects_ = 0;
}

bool ClockModel::warm() const { return !points_.empty() && points_.back().x_s - points_.front().x_s >= kWarmUp_s; }

std::int64_t ClockModel::offset_ns() const {
  if (!any_) return 0;
  const double x_s = static_cast<double>(last_source_ns_ - base_ns_) * 1e-9;
  return first_ns_ + std::llround(line_ns(x_s));
}

/// Whether the sample is the last of several that contradict the line in the same way.
bool ClockModel::is_step(double d_ns, bool is_usable) {
  suspects_ = suspects_ > 0 && std::abs(d_ns - suspect_ns_) <= kAgreement_ns ? suspects_ + 1 : 1;
  suspect_ns_ = d_ns;
  return suspects_ >= (is_usable ? kLateAgree : kAgree);
}

void ClockModel::add(double x_s, double d_ns) {
  const auto bucket = [](double x) { return std::floor(x / kBucket_s); };
  if (!points_.empty() && bucket(points_.back().x_s) == bucket(x_s)) {
    if (d_ns >= points_.back().d_ns) return;
    points_.back() = {x_s, d_ns};
  } else {
    points_.push_back({x_s, d_ns});
  }
  while (points_.front().x_s < x_s - kWindow_s) points_.pop_front();
  fit();
}

void ClockModel::fit() {
  if (!warm()) {
    slope_ = 0;
    at_ = *std::min_element(points_.begin(), points_.end(),
                            [](const Point& a, const Point& b) { return a.d_ns < b.d_ns; });
    return;
  }
  std::vector<Point> hull;
  double mean_s = 0;
  for (const Point& p : points_) {
    mean_s += p.x_s / static_cast<double>(points_.size());
    const auto is_above = [&p](const Point& a, const Point& b) {
      return (b.d_ns - a.d_ns) * (p.x_s - a.x_s) >= (p.d_ns - a.d_ns) * (b.x_s - a.x_s);
    };
    while (hull.size() >= 2 && is_above(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(p);
  }
  std::size_t edge = 0;
  while (edge + 2 < hull.size() && hull[edge + 1].x_s < mean_s) ++edge;
  at_ = hull[edge];
  slope_ =
      std::clamp((hull[edge + 1].d_ns - at_.d_ns) * 1e-9 / (hull[edge + 1].x_s - at_.x_s), -kMostDrift, kMostDrift);
}

std::optional<ClockModel::Stamp> ClockModel::take(const Sample& sample) {
  const std::int64_t source_ns = sample.sent_ns != 0 ? sample.sent_ns : sample.capture_ns;
  const bool is_back = any_ && (sample.frame <= last_frame_ || source_ns < last_source_ns_);
  if (is_back) {
    const bool is_late =
        sample.frame <= last_frame_ && last_frame_ - sample.frame < kReordered && source_ns <= last_source_ns_;
    if (is_late) {
      ++refused_;
      return std::nullopt;
    }
    ++restarts_;
  }
  if (!any_ || is_back) start(source_ns, sample.arrival_ns);
  auto d_ns = static_cast<double>(sample.arrival_ns - source_ns - first_ns_);
  auto x_s = static_cast<double>(source_ns - base_ns_) * 1e-9;
  if (!points_.empty() && points_.back().x_s - points_.front().x_s >= kTrusted_s) {
    const double excess_ns = d_ns - line_ns(x_s);
    const bool is_usable = excess_ns >= kTooEarly_ns && excess_ns <= kTooLate_ns;
    if (is_usable && excess_ns <= kLate_ns) {
      suspects_ = 0;
    } else if (is_step(d_ns, is_usable)) {
      ++restarts_;
      start(source_ns, sample.arrival_ns);
      d_ns = x_s = 0;
    } else if (!is_usable) {
      ++refused_;
      return std::nullopt;
    }
  }
  last_frame_ = sample.frame;
  last_source_ns_ = source_ns;
  add(x_s, d_ns);

  Stamp stamp;
  const std::int64_t age_ns = source_ns - sample.capture_ns;
  const std::int64_t utc_delay_ns = sample.arrival_utc_ns - source_ns;
  stamp.offered = sample.shows_utc && utc_delay_ns >= -kUtcSlack_ns && utc_delay_ns <= kUtcSlowest_ns;
  if (sample.shows_utc && !stamp.offered) wrong_utc_s_ = -static_cast<double>(utc_delay_ns) * 1e-9;
  stamp.sent_ns =
      stamp.offered ? sample.arrival_ns - utc_delay_ns : source_ns + first_ns_ + std::llround(line_ns(x_s));
  stamp.sent_ns = std::min(stamp.sent_ns, sample.arrival_ns);
  stamp.capture_ns = stamp.sent_ns - std::max<std::int64_t>(age_ns, 0);
  return stamp;
}

}  // namespace kilotwin::ark
