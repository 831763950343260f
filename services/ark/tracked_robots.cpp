#include "services/ark/tracked_robots.hpp"

namespace kilotwin::ark {

TrackedRobots::TrackedRobots(const RunPlan& plan, const dds::Participant& participant,
                             const ServiceContext& context)
    : input_(plan, participant),
      heard_input_(plan, participant),
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
  const Clock::time_point taken = Clock::now();
  std::vector<TrackerInput::Stamped> arrived = input_.take(taken, now_cycle, pace);
  std::vector<HeardMessage> heard = heard_input_.take();
  if (!stamped_.empty()) {
    for (; !stamped_.empty() && stamped_.front().first <= now; stamped_.pop_front())
      samples_.push_back(std::move(stamped_.front().second));
  } else {
    for (TrackerInput::Stamped& stamped : arrived) {
      // A sample that came before the run began to count waited for the run, not for its tick.
      if (counts_) underway_.push_back({now + 1, stamped.exposed, stamped.arrival, taken});
      samples_.push_back(std::move(stamped.sample));
    }
    heard_ += heard.size();
    if (!heard.empty()) {
      TrackerSample& sample = samples_.emplace_back();
      sample.capture_cycle = now_cycle;
      sample.heard = std::move(heard);
    }
  }
  counts_ = true;
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
  const auto seconds = [](Clock::duration time) { return std::chrono::duration<double>(time).count(); };
  for (; !underway_.empty() && underway_.front().acts <= now; underway_.pop_front()) {
    const Underway& sample = underway_.front();
    exposed_.add(seconds(at - sample.exposed));
    effect_.add(seconds(at - sample.arrival));
    wait_.add(seconds(sample.published - sample.arrival));
    step_.add(seconds(at - sample.published));
  }
}

void TrackedRobots::fill(TrackingTotals& totals) const {
  totals.trackers = input_.report();
  totals.exposed_p50_s = exposed_.quantile_s(0.5);
  totals.exposed_p99_s = exposed_.quantile_s(0.99);
  totals.effect_p50_s = effect_.quantile_s(0.5);
  totals.effect_p99_s = effect_.quantile_s(0.99);
  totals.wait_p50_s = wait_.quantile_s(0.5);
  totals.wait_p99_s = wait_.quantile_s(0.99);
  totals.step_p50_s = step_.quantile_s(0.5);
  totals.step_p99_s = step_.quantile_s(0.99);
  totals.heard = heard_;
  totals.joined = joined_;
  totals.left = left_;
  totals.lost = lost_;
}

}  // namespace kilotwin::ark
