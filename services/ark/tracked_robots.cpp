#include "services/ark/tracked_robots.hpp"

namespace kilotwin::ark {

TrackedRobots::TrackedRobots(const RunPlan& plan, const dds::Participant& participant,
                             const ServiceContext& context)
    : input_(plan, participant),
      stamped_(context.tracker_samples.begin(), context.tracker_samples.end()),
      announced_(plan.robots()) {
  for (const Directive& directive : context.inputs) {
    if (directive.kind != DirectiveKind::kMembership) continue;
    announced_[directive.membership.robot] =
        static_cast<std::uint8_t>(1 + static_cast<int>(directive.membership.membership));
  }
}

std::span<const TrackerSample> TrackedRobots::samples_of(Tick now, std::int64_t now_cycle, double pace,
                                                         RunObserver& observer) {
  samples_.clear();
  // The model of the clocks learns from all samples, also from those that another attempt has forestalled.
  std::vector<TrackerInput::Stamped> arrived = input_.take(Clock::now(), now_cycle, pace);
  if (!stamped_.empty()) {
    for (; !stamped_.empty() && stamped_.front().first <= now; stamped_.pop_front())
      samples_.push_back(std::move(stamped_.front().second));
  } else {
    for (TrackerInput::Stamped& stamped : arrived) {
      underway_.push_back({now + 1, stamped.arrival});
      samples_.push_back(std::move(stamped.sample));
    }
  }
  for (const TrackerSample& sample : samples_) observer.tracker_sample(now, sample);
  return samples_;
}

std::vector<MembershipChange> TrackedRobots::changes(const TrackedSwarm& swarm) {
  std::vector<MembershipChange> due;
  swarm.changes_due(due);
  std::vector<std::uint8_t> still(announced_.size());
  std::vector<MembershipChange> fresh;
  for (const MembershipChange& change : due) {
    const auto code = static_cast<std::uint8_t>(1 + static_cast<int>(change.membership));
    still[change.robot] = code;
    if (announced_[change.robot] == code) continue;
    fresh.push_back(change);
    switch (change.membership) {
      case Membership::kJoined: ++joined_; break;
      case Membership::kLeft: ++left_; break;
      case Membership::kLost: ++lost_; break;
    }
  }
  announced_.swap(still);
  return fresh;
}

void TrackedRobots::acted(Tick now, Clock::time_point at) {
  for (; !underway_.empty() && underway_.front().acts <= now; underway_.pop_front())
    effect_.add(std::chrono::duration<double>(at - underway_.front().arrival).count());
}

void TrackedRobots::fill(TrackingTotals& totals) const {
  totals.trackers = input_.report();
  totals.effect_p50_s = effect_.quantile_s(0.5);
  totals.effect_p99_s = effect_.quantile_s(0.99);
  totals.joined = joined_;
  totals.left = left_;
  totals.lost = lost_;
}

}  // namespace kilotwin::ark
