#include "clients/monitor/commanded_motion.hpp"

#include <algorithm>
#include <numeric>

#include "core/plan/motion_settings.hpp"

namespace kilotwin::monitor {
namespace {

/// Noise that a robot's heading has at least, whatever the model says, rad^2/s.
constexpr double kLeastTurnNoise = 1e-5;
/// The arena as one partition.
constexpr double kWhole_mm = 1e9;

}  // namespace

CommandedMotion::CommandedMotion(const RunPlan& plan, std::span<const std::uint32_t> watched)
    : plan_(without_noise(plan)),
      watched_(watched.begin(), watched.end()),
      noise_(noise_terms(plan)),
      factor_variance_s_(plan.motion_settings().factor_variance_s),
      drive_(plan_),
      effects_(plan_),
      memory_(plan_),
      fields_(plan_, PartitionId{0}, kWhole_mm),
      motion_(watched_.size()),
      ids_(plan.robots()),
      tracked_(plan.robots(), 0),
      remembered_(std::size_t{plan.robots()} * memory_.size()) {
  std::iota(ids_.begin(), ids_.end(), 0u);
  for (std::uint32_t robot = 0; robot < plan.robots() && memory_.size() > 0; ++robot)
    memory_.start(robot, std::span(remembered_).subspan(std::size_t{robot} * memory_.size(), memory_.size()));
}

void CommandedMotion::remember(const SwarmView& swarm) {
  const bool any = memory_.size() > 0 || fields_.any();
  if (any && last_ && *last_ + 1 == swarm.tick) {
    const RobotColumns before{ids_, x_mm_, y_mm_, heading_rad_, remembered_, duties_, tracked_};
    fields_.count(*last_, before, remembered_);
    memory_.advance(*last_, before, swarm.x_mm, swarm.y_mm, swarm.heading_rad, remembered_);
  }
  last_ = swarm.tick;
}

void CommandedMotion::advance(const SwarmView& swarm, std::span<const Duties> duties) {
  remember(swarm);
  drives_.reserve(plan_.robots());
  drives_.count = 0;
  for (const std::uint32_t robot : watched_)
    drive_.add(drives_, robot, robot, swarm.tick, duties[robot], swarm.heading_rad[robot], 1);
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    const WheelMotion before = motion_[i];
    WheelMotion now;
    now.nominal_left_mm_s = drives_.left_mm_s[i];
    now.nominal_right_mm_s = drives_.right_mm_s[i];
    now.limit_mm_s = plan_.motion_settings().effects_limit_mm_s;
    now.driven = duties[watched_[i]].any() ? 1 : 0;
    now.change_left_mm_s = now.nominal_left_mm_s - before.nominal_left_mm_s;
    now.change_right_mm_s = now.nominal_right_mm_s - before.nominal_right_mm_s;
    motion_[i] = now;
  }
  if (!effects_.empty()) add_effects(swarm.tick, swarm, duties);
  for (std::size_t i = 0; i < watched_.size(); ++i) add_noise(i, watched_[i], duties[watched_[i]]);
  if (memory_.size() == 0 && !fields_.any()) return;
  x_mm_ = swarm.x_mm;
  y_mm_ = swarm.y_mm;
  heading_rad_ = swarm.heading_rad;
  duties_.assign(duties.begin(), duties.end());
}

void CommandedMotion::add_effects(Tick from, const SwarmView& swarm, std::span<const Duties> duties) {
  const RobotColumns all{ids_, swarm.x_mm, swarm.y_mm, swarm.heading_rad, remembered_, duties, tracked_};
  effects_.evaluate(from, all, watched_, &fields_, changes_);
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    WheelMotion& motion = motion_[i];
    const bool acts = motion.driven > 0 || effects_.act_at_rest();
    if (!acts) continue;
    motion.gain_left = changes_.left_gain[i];
    motion.gain_right = changes_.right_gain[i];
    motion.offset_left_mm_s = changes_.left_mm_s[i];
    motion.offset_right_mm_s = changes_.right_mm_s[i];
    motion.sideways_mm_s = limited(changes_.sideways_mm_s[i], motion.limit_mm_s);
    motion.drift_x_mm_s = limited(changes_.drift_x_mm_s[i], motion.limit_mm_s);
    motion.drift_y_mm_s = limited(changes_.drift_y_mm_s[i], motion.limit_mm_s);
  }
}

void CommandedMotion::add_noise(std::size_t i, std::uint32_t robot, Duties duties) {
  WheelMotion& motion = motion_[i];
  motion.relative_noise_left = motion.relative_noise_right = factor_variance_s_;
  const std::uint8_t bit = bit_of(command_of(duties));
  for (const NoiseTerm& term : noise_) {
    if (!term.robots.empty() && !std::binary_search(term.robots.begin(), term.robots.end(), robot)) continue;
    if (term.commands != 0 ? (term.commands & bit) == 0 : !duties.any()) continue;
    using Target = EffectSettings::Target;
    switch (term.target) {
      case Target::kWheelGain:
        motion.relative_noise_left += term.left ? term.variance_per_s : 0;
        motion.relative_noise_right += term.right ? term.variance_per_s : 0;
        break;
      case Target::kWheelOffset:
        motion.noise_left += term.left ? term.variance_per_s : 0;
        motion.noise_right += term.right ? term.variance_per_s : 0;
        break;
      case Target::kTurnRate: motion.noise_turn += term.variance_per_s; break;
      case Target::kBodyDrift:
      case Target::kWorldDrift: motion.noise_position += term.variance_per_s; break;
      default: break;
    }
  }
  motion.noise_turn = std::max(motion.noise_turn, kLeastTurnNoise);
}

}  // namespace kilotwin::monitor
