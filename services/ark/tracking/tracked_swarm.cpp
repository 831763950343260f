#include "services/ark/tracking/tracked_swarm.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

/// A robot counts as seen for this long after its last sample.
constexpr std::int64_t kFresh = 800'000;  // 0.1 s
/// Mahalanobis distance, squared, beyond which a sample contradicts the estimate; for one whose identity is in doubt.
constexpr double kGate = 25, kGateInDoubt = 9;
/// After so many contradictions in a row the robot is where they say: somebody has moved it, or identities were swapped.
constexpr std::uint32_t kJump = 3;
/// A robot joins after so many samples.
constexpr std::uint32_t kSamplesToJoin = 3;
/// Heading from motion: from this speed on, mm/s, with this error of a robot that turns about a leg, rad.
constexpr double kMoving_mm_s = 4, kPivotError_rad = 0.35;

double seconds(std::int64_t cycles) { return static_cast<double>(cycles) / kNominalClockHz; }

}  // namespace

TrackedSwarm::TrackedSwarm(const RunPlan& plan)
    : plan_(plan),
      settings_(plan.tracking_settings()),
      bridge_cycles_(static_cast<std::int64_t>(settings_.bridge_s * kNominalClockHz)) {
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.tracked(robot)) robots_.push_back(robot);
  }
  state_.resize(robots_.size());
  for (Track& track : state_) track.is_member = settings_.present_at_start;
  next_ = state_;
}

std::size_t TrackedSwarm::index_of(std::uint32_t robot) const {
  const auto found = std::lower_bound(robots_.begin(), robots_.end(), robot);
  return found != robots_.end() && *found == robot ? static_cast<std::size_t>(found - robots_.begin())
                                                   : robots_.size();
}

bool TrackedSwarm::is_member(std::uint32_t robot) const {
  const std::size_t i = index_of(robot);
  return i < state_.size() && state_[i].is_member;
}

void TrackedSwarm::take(Tick now, std::span<const TrackerSample> samples) {
  next_ = state_;
  said_.clear();
  for (const TrackerSample& sample : samples) apply(sample);
  expire(now);
  for (const TrackerSample& sample : samples) {
    for (const HeardMessage& heard : sample.heard) hear(heard);
  }
}

void TrackedSwarm::hear(const HeardMessage& heard) {
  if (const auto sender = sender_of(heard)) said_[*sender] = heard.message;
}

/// The robot that the message names, else the one whose place fits best to what the listener heard.
std::optional<std::uint32_t> TrackedSwarm::sender_of(const HeardMessage& heard) const {
  if (heard.robot != HeardMessage::kUnknown)
    return index_of(heard.robot) < next_.size() ? std::optional(heard.robot) : std::nullopt;
  const std::size_t listener = index_of(heard.listener);
  if (listener >= next_.size() || !next_[listener].known) return std::nullopt;
  const auto& at = next_[listener].v;
  std::optional<std::uint32_t> best;
  double least_mm = kFarthestSample_mm;
  for (std::size_t i = 0; i < next_.size(); ++i) {
    if (i == listener || !next_[i].known || !settings_.says_heard(robots_[i])) continue;
    const double dx_mm = next_[i].v[kX] - at[kX], dy_mm = next_[i].v[kY] - at[kY];
    const double distance_mm = __builtin_sqrt(dx_mm * dx_mm + dy_mm * dy_mm);
    const double off_mm = heard.distance_mm < 0 ? distance_mm : std::abs(distance_mm - double{heard.distance_mm});
    if (off_mm >= least_mm) continue;
    least_mm = off_mm;
    best = robots_[i];
  }
  return best;
}

void TrackedSwarm::apply(const TrackerSample& sample) {
  const TrackerSettings tracker = tracker_of(settings_, sample.source);
  for (std::size_t n = 0; n < sample.robot.size(); ++n) {
    const std::size_t i = index_of(sample.robot[n]);
    const auto state = TrackedState{sample.state[n]};
    if (i >= next_.size() || (state != TrackedState::kSeen && state != TrackedState::kInDoubt)) continue;
    const MeasuredPose measured = measured_pose(tracker, sample, n);
    if (measured.is_near()) measure(next_[i], measured);
  }
}

void TrackedSwarm::begin(Track& track, const MeasuredPose& measured) const {
  const bool is_member = track.is_member;
  const std::uint8_t led = track.led;
  const double old_heading = track.v[kHeading];
  track = Track{};
  track.is_member = is_member;
  track.led = led;
  track.known = track.was_seen = true;
  track.at = track.seen = measured.cycle;
  track.accepted = 1;
  auto& v = track.v;
  v[kX] = measured.x_mm;
  v[kY] = measured.y_mm;
  v[kXx] = measured.xx;
  v[kXy] = measured.xy;
  v[kYy] = measured.yy;
  v[kVxvx] = v[kVyvy] = settings_.speed_change_mm_s * settings_.speed_change_mm_s;
  v[kTurnVariance] = settings_.turn_change_rad_s * settings_.turn_change_rad_s;
  v[kHeading] = old_heading;
  v[kHeadingVariance] = kNoHeading_rad2;
  if (measured.led != kUnknownLed && !measured.in_doubt) track.led = measured.led;
  if (measured.heading_variance < kNoHeading_rad2 && !measured.in_doubt) {
    v[kHeading] = measured.heading_rad;
    v[kHeadingVariance] = measured.heading_variance;
    track.has_heading = true;
  }
}

void TrackedSwarm::predict(Track& track, std::int64_t cycle) const {
  const double t = seconds(cycle - track.at);
  if (t <= 0) return;
  auto& v = track.v;
  track.at = cycle;
  // On an arc: the chord lies half the turn ahead of the velocity.
  const double half = track.has_heading ? v[kTurn] * t / 2 : 0;
  const double c = kt_cos(half), s = kt_sin(half);
  const double chord = half * half < 1e-12 ? t : t * s / half;
  const double mx = c * v[kVx] - s * v[kVy], my = s * v[kVx] + c * v[kVy];
  v[kX] += chord * mx;
  v[kY] += chord * my;
  v[kVx] = c * mx - s * my;
  v[kVy] = s * mx + c * my;
  v[kHeading] = wrapped(kt_fmod(v[kHeading] + v[kTurn] * t, 2 * kPi));
  const double q = settings_.speed_change_mm_s * settings_.speed_change_mm_s;
  v[kXx] += t * (2 * v[kXvx] + t * v[kVxvx]) + q * t * t * t / 3;
  v[kXy] += t * (v[kXvy] + v[kYvx] + t * v[kVxvy]);
  v[kYy] += t * (2 * v[kYvy] + t * v[kVyvy]) + q * t * t * t / 3;
  v[kXvx] += t * v[kVxvx] + q * t * t / 2;
  v[kXvy] += t * v[kVxvy];
  v[kYvx] += t * v[kVxvy];
  v[kYvy] += t * v[kVyvy] + q * t * t / 2;
  v[kVxvx] += q * t;
  v[kVyvy] += q * t;
  const double r = settings_.turn_change_rad_s * settings_.turn_change_rad_s;
  v[kHeadingVariance] += t * (2 * v[kHeadingTurn] + t * v[kTurnVariance]) + r * t * t * t / 3;
  v[kHeadingTurn] += t * v[kTurnVariance] + r * t * t / 2;
  v[kTurnVariance] += r * t;
}

void TrackedSwarm::measure_heading(Track& track, double heading_rad, double variance) const {
  auto& v = track.v;
  const double innovation = wrapped(heading_rad - v[kHeading]), sum = v[kHeadingVariance] + variance;
  const double gain = v[kHeadingVariance] / sum, turn_gain = v[kHeadingTurn] / sum;
  v[kHeading] = wrapped(v[kHeading] + gain * innovation);
  v[kTurn] += turn_gain * innovation;
  v[kTurnVariance] -= turn_gain * v[kHeadingTurn];
  v[kHeadingTurn] -= gain * v[kHeadingTurn];
  v[kHeadingVariance] -= gain * v[kHeadingVariance];
  track.has_heading = true;
}

void TrackedSwarm::measure(Track& track, const MeasuredPose& measured) {
  if (!track.known) return begin(track, measured);
  predict(track, measured.cycle);
  auto& v = track.v;
  // A sample that is older than the estimate is compared with where the robot came from.
  const double back_s = seconds(measured.cycle - track.at);
  const double dx = measured.x_mm - (v[kX] + back_s * v[kVx]), dy = measured.y_mm - (v[kY] + back_s * v[kVy]);
  const double a = v[kXx] + measured.xx, b = v[kXy] + measured.xy, d = v[kYy] + measured.yy;
  const double determinant = a * d - b * b;
  if (!(determinant > 0)) return begin(track, measured);
  const double wx = (d * dx - b * dy) / determinant, wy = (a * dy - b * dx) / determinant;
  track.in_doubt = measured.in_doubt;
  if (dx * wx + dy * wy > (measured.in_doubt ? kGateInDoubt : kGate)) {
    if (measured.in_doubt || ++track.outliers < kJump) return;
    ++jumps_;
    return begin(track, measured);
  }
  track.outliers = 0;
  track.seen = std::max(track.seen, measured.cycle);
  track.accepted = std::min(track.accepted + 1, kSamplesToJoin);
  // Rows of gain: the covariance of each value with the position, times the inverse of the innovation's.
  const auto gain = [&](double with_x, double with_y) {
    return std::pair{(d * with_x - b * with_y) / determinant, (a * with_y - b * with_x) / determinant};
  };
  const auto [gxx, gxy] = gain(v[kXx], v[kXy]);
  const auto [gyx, gyy] = gain(v[kXy], v[kYy]);
  const auto [hxx, hxy] = gain(v[kXvx], v[kYvx]);
  const auto [hyx, hyy] = gain(v[kXvy], v[kYvy]);
  v[kX] += gxx * dx + gxy * dy;
  v[kY] += gyx * dx + gyy * dy;
  v[kVx] += hxx * dx + hxy * dy;
  v[kVy] += hyx * dx + hyy * dy;
  const auto old = v;
  v[kXx] -= gxx * old[kXx] + gxy * old[kXy];
  v[kXy] -= gxx * old[kXy] + gxy * old[kYy];
  v[kYy] -= gyx * old[kXy] + gyy * old[kYy];
  v[kXvx] -= gxx * old[kXvx] + gxy * old[kYvx];
  v[kXvy] -= gxx * old[kXvy] + gxy * old[kYvy];
  v[kYvx] -= gyx * old[kXvx] + gyy * old[kYvx];
  v[kYvy] -= gyx * old[kXvy] + gyy * old[kYvy];
  v[kVxvx] -= hxx * old[kXvx] + hxy * old[kYvx];
  v[kVxvy] -= hxx * old[kXvy] + hxy * old[kYvy];
  v[kVyvy] -= hyx * old[kXvy] + hyy * old[kYvy];
  // A sample near the estimate is of this body, whatever its name: its heading and its LED count, too.
  if (measured.led != kUnknownLed) track.led = measured.led;
  if (measured.heading_variance < kNoHeading_rad2) {
    measure_heading(track, measured.heading_rad, measured.heading_variance);
    return;
  }
  const double speed2 = v[kVx] * v[kVx] + v[kVy] * v[kVy];
  if (speed2 < kMoving_mm_s * kMoving_mm_s || speed2 < 4 * (v[kVxvx] + v[kVyvy])) return;
  measure_heading(track, kt_atan2(v[kVy], v[kVx]),
                  kPivotError_rad * kPivotError_rad + (v[kVxvx] + v[kVyvy]) / speed2);
}

void TrackedSwarm::expire(Tick now) {
  const std::int64_t cycle = now.count() * plan_.tick_length.cycles();
  for (Track& track : next_) {
    if (!track.known || cycle - track.seen <= bridge_cycles_) continue;
    track.known = false;
    track.accepted = 0;
  }
}

void TrackedSwarm::emit(Tick now, TrackingFrame& frame) const {
  frame.clear();
  frame.tick = now;
  const std::int64_t cycles = plan_.tick_length.cycles(), cycle = now.count() * cycles;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if (!next_[i].known) continue;
    Track track = next_[i];
    predict(track, cycle + cycles);
    const TrackedState state = track.in_doubt                ? TrackedState::kInDoubt
                               : cycle - track.seen > kFresh ? TrackedState::kPredicted
                                                             : TrackedState::kSeen;
    const auto within = [](double value) { return std::clamp(value, -kFarthestSample_mm, kFarthestSample_mm); };
    frame.robot.push_back(robots_[i]);
    frame.state.push_back(static_cast<std::uint8_t>(state));
    frame.x_mm.push_back(within(track.v[kX]));
    frame.y_mm.push_back(within(track.v[kY]));
    frame.heading_rad.push_back(track.v[kHeading]);
    frame.led.push_back(track.led);
  }
  for (const auto& [robot, message] : said_) {
    frame.said_robot.push_back(robot);
    frame.said_message.push_back(message);
  }
}

void TrackedSwarm::commit(std::span<const MembershipChange> memberships) {
  state_ = next_;
  for (const MembershipChange& change : memberships) {
    const std::size_t i = index_of(change.robot);
    KILOTWIN_DEMAND(i < state_.size());
    state_[i].is_member = change.membership == Membership::kJoined;
  }
  next_ = state_;
  said_.clear();
}

void TrackedSwarm::changes_due(std::vector<MembershipChange>& changes) const {
  changes.clear();
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const Track& track = next_[i];
    if (!track.known) {
      if (track.is_member && track.was_seen) changes.push_back({robots_[i], Membership::kLost});
      continue;
    }
    const bool is_inside = plan_.world.arena.clearance_mm({track.v[kX], track.v[kY]}) > -kRobotRadius_mm;
    if (track.is_member && !is_inside) changes.push_back({robots_[i], Membership::kLeft});
    if (!track.is_member && is_inside && track.accepted >= kSamplesToJoin)
      changes.push_back({robots_[i], Membership::kJoined});
  }
}

std::uint64_t TrackedSwarm::hash_part() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const Track& track = state_[i];
    if (!track.was_seen) continue;
    HashState state(static_cast<std::uint64_t>(HashDomain::kTracked) << 32 | robots_[i]);
    for (const double value : track.v) state.add(hash_bits(value));
    state.add(static_cast<std::uint64_t>(track.at));
    state.add(static_cast<std::uint64_t>(track.seen));
    state.add(track.led | std::uint64_t{track.known} << 8 | std::uint64_t{track.is_member} << 9 |
              std::uint64_t{track.in_doubt} << 10 | std::uint64_t{track.accepted} << 16 |
              std::uint64_t{track.outliers} << 32);
    sum += state.finish();
  }
  return sum;
}

void TrackedSwarm::save(proto::StationState& state) const {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const Track& track = state_[i];
    proto::TrackedRobotState& saved = *state.add_tracked();
    saved.set_robot(robots_[i]);
    saved.set_flags(static_cast<std::uint32_t>(track.known) | static_cast<std::uint32_t>(track.was_seen) << 1 |
                    static_cast<std::uint32_t>(track.has_heading) << 2 |
                    static_cast<std::uint32_t>(track.in_doubt) << 3 |
                    static_cast<std::uint32_t>(track.is_member) << 4);
    saved.set_estimate_cycle(track.at);
    saved.set_seen_cycle(track.seen);
    for (const double value : track.v) saved.add_value(value);
    saved.set_led(track.led);
    saved.set_outliers(track.outliers << 2 | track.accepted);
  }
}

void TrackedSwarm::load(Tick, const proto::StationState& state) {
  if (static_cast<std::size_t>(state.tracked_size()) != robots_.size())
    throw RunError("the checkpoint holds other tracked robots than this experiment");
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const proto::TrackedRobotState& saved = state.tracked(static_cast<int>(i));
    if (saved.robot() != robots_[i] || saved.value_size() != static_cast<int>(kValues))
      throw RunError("the checkpoint's state of tracked robot " + std::to_string(robots_[i]) + " is damaged");
    Track& track = state_[i];
    track.known = (saved.flags() & 1u) != 0;
    track.was_seen = (saved.flags() & 2u) != 0;
    track.has_heading = (saved.flags() & 4u) != 0;
    track.in_doubt = (saved.flags() & 8u) != 0;
    track.is_member = (saved.flags() & 16u) != 0;
    track.at = saved.estimate_cycle();
    track.seen = saved.seen_cycle();
    std::copy(saved.value().begin(), saved.value().end(), track.v.begin());
    track.led = static_cast<std::uint8_t>(saved.led());
    track.outliers = saved.outliers() >> 2;
    track.accepted = saved.outliers() & 3u;
  }
  next_ = state_;
}

}  // namespace kilotwin::ark
