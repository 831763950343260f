/// Tracked robots of a host: who is there, the LED that was seen, and messages by rules or as heard.
#include <algorithm>
#include <vector>

#include "core/base/error.hpp"
#include "core/plan/tracking_settings.hpp"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

void BehavioursEngine::take_memberships(const TrackedInputs& tracked) {
  for (const MembershipChange& change : tracked.memberships) {
    if (!share_.contains(change.robot)) continue;
    const std::uint32_t i = change.robot - share_.first;
    absent_[i] = static_cast<std::uint8_t>(change.membership != Membership::kJoined);
    if (absent_[i] != 0) {
      life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kAbsent);
      motor_left_[i] = motor_right_[i] = spin_up_[i] = led_[i] = holds_[i] = is_due_[i] = 0;
    } else if (presence_[i] == Presence::kFailed) {
      life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kFailed);
    } else {
      life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kIdle);
    }
  }
}

/// Tracked robots show the LED that was seen, and say what rules have for them.
void BehavioursEngine::follow(const TrackingFrame& frame) {
  KILOTWIN_DEMAND(frame.tick + 1 == now_);
  for (std::size_t n = 0; n < frame.robot.size(); ++n) {
    if (!share_.contains(frame.robot[n])) continue;
    const std::uint32_t i = frame.robot[n] - share_.first;
    if (frame.led[n] != kUnknownLed) seen_led_[i] = frame.led[n];
    if (absent_[i] != 0) continue;
    if (presence_[i] == Presence::kNone && !plan_.tracking_settings().says_heard(frame.robot[n]))
      say_by_rule(i, {frame.x_mm[n], frame.y_mm[n], frame.heading_rad[n]});
  }
  for (std::size_t n = 0; n < frame.said_robot.size(); ++n) {
    const std::uint32_t i = frame.said_robot[n] - share_.first;
    if (!share_.contains(frame.said_robot[n]) || absent_[i] != 0) continue;
    due_[i] = frame.said_message[n];
    is_due_[i] = 1;
  }
  say_what_was_heard();
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    if (absent_[i] == 0 && plan_.tracked(share_.first + i))
      led_[i] = seen_led_[i] == kUnknownLed ? std::uint8_t{0} : seen_led_[i];
  }
}

/// A message that was heard is said once, as soon as the channel is free. A newer one takes the place of one that waits.
void BehavioursEngine::say_what_was_heard() {
  for (std::uint32_t i = 0; i < share_.size(); ++i) {
    const std::uint32_t robot = share_.first + i;
    if (!plan_.tracked(robot) || presence_[i] != Presence::kNone || absent_[i] != 0 ||
        !plan_.tracking_settings().says_heard(robot))
      continue;
    if (sent_[i] != 0) holds_[i] = 0;
    life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kRunning);
    tx_period_[i] = 0;
    if (is_due_[i] == 0 || requested_[i] == 0 || holds_[i] != 0) continue;
    message_[i] = due_[i];
    crc_error_[i] = 0;
    is_due_[i] = 0;
    holds_[i] = offers_[i] = 1;
  }
}

void BehavioursEngine::say_by_rule(std::uint32_t i, const Pose& p_WR) {
  const std::uint32_t robot = share_.first + i;
  const std::uint8_t led = seen_led_[i];
  const auto applies = [&](const SaysRuleSettings& rule) {
    if (!rule.robots.empty() && !std::binary_search(rule.robots.begin(), rule.robots.end(), robot)) return false;
    if (rule.led && *rule.led != led) return false;
    if (!rule.circle) return true;
    const double dx = p_WR.x_mm - rule.circle->x_mm, dy = p_WR.y_mm - rule.circle->y_mm;
    return dx * dx + dy * dy <= rule.circle->radius_mm * rule.circle->radius_mm;
  };
  if (sent_[i] != 0) holds_[i] = 0;
  const std::vector<SaysRuleSettings>& rules = plan_.tracking_settings().rules_of(robot);
  const auto rule = std::find_if(rules.begin(), rules.end(), applies);
  if (rule == rules.end()) {
    life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kIdle);
    holds_[i] = 0;
    return;
  }
  life_cycle_[i] = static_cast<std::uint8_t>(LifeCycle::kRunning);
  tx_period_[i] = rule->tx_period;
  if (requested_[i] == 0 || holds_[i] != 0) return;
  message_[i] = rule->message;
  crc_error_[i] = 0;
  if (rule->id_octet) message_[i][*rule->id_octet] = static_cast<std::uint8_t>(robot & 255);
  holds_[i] = offers_[i] = 1;
}

}  // namespace kilotwin::behaviours
