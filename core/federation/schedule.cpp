#include "core/federation/schedule.hpp"

#include <algorithm>

namespace kilotwin {

RunSchedule::RunSchedule(Tick first, Tick last, std::int64_t checkpoint_every)
    : first_(first), last_(last), checkpoint_every_(checkpoint_every) {}

void RunSchedule::add(const Directive& directive) {
  if (directive.sequence_number < known_) return;
  out_of_order_.emplace(directive.sequence_number, directive);
  for (auto next = out_of_order_.begin(); next != out_of_order_.end() && next->first == known_;
       next = out_of_order_.erase(next)) {
    pending_.push_back(next->second);
    ++known_;
  }
}

void RunSchedule::apply_until(Tick now) {
  if (inputs_tick_ != now) {
    inputs_tick_ = now;
    overhead_inputs_.clear();
    memberships_.clear();
    relocations_.clear();
    if (pause_again_ == now) {
      paused_ = true;
      pause_again_ = Tick{-1};
    }
  }
  for (; !pending_.empty() && pending_.front().tick <= now; pending_.pop_front()) {
    const Directive& directive = pending_.front();
    switch (directive.kind) {
      case DirectiveKind::kPause: paused_ = true; break;
      case DirectiveKind::kContinue:
        paused_ = false;
        pause_again_ = Tick{-1};
        break;
      case DirectiveKind::kStep:
        paused_ = false;
        pause_again_ = directive.tick + std::max<std::int64_t>(1, directive.steps);
        break;
      case DirectiveKind::kStop:
        stopped_ = stopped_ || now < last_;
        last_ = std::min(last_, now);
        break;
      case DirectiveKind::kCheckpoint: checkpoints_.push_back(directive.tick); break;
      case DirectiveKind::kOverheadInput: overhead_inputs_.push_back(directive.packet); break;
      case DirectiveKind::kMembership: memberships_.push_back(directive.membership); break;
      case DirectiveKind::kRelocation: relocations_.push_back(directive.relocation); break;
    }
  }
}

RunSchedule::Verdict RunSchedule::verdict(Tick now) {
  if (known() < mentioned_) return Verdict::kAwaitDirective;
  apply_until(now);
  if (now >= last_) return Verdict::kFinished;
  return paused_ ? Verdict::kPaused : Verdict::kStep;
}

bool RunSchedule::checkpoint_at(Tick now) const {
  if (now <= first_) return false;
  if (checkpoint_every_ > 0 && now.count() % checkpoint_every_ == 0) return true;
  return std::find(checkpoints_.begin(), checkpoints_.end(), now) != checkpoints_.end();
}

Directive Ingress::stamp(Tick now, Directive directive) {
  if (steps_end_ >= Tick{0} && steps_end_ <= now + kAnnounceAhead) {
    // The run pauses at steps_end_, before an announcement could reach all federates. So the directive acts at that tick.
    latest_ = std::max(latest_, steps_end_);
    pausing_ = true;
    steps_end_ = Tick{-1};
  }
  const Tick tick = pausing_ ? latest_ : std::max(latest_, now + kAnnounceAhead);
  latest_ = tick;
  directive.sequence_number = next_sequence_number_++;
  directive.tick = tick;
  switch (directive.kind) {
    case DirectiveKind::kPause:
      pausing_ = true;
      steps_end_ = Tick{-1};
      break;
    case DirectiveKind::kContinue:
      pausing_ = false;
      steps_end_ = Tick{-1};
      break;
    case DirectiveKind::kStep:
      pausing_ = false;
      steps_end_ = tick + std::max<std::int64_t>(1, directive.steps);
      break;
    default: break;
  }
  return directive;
}

}  // namespace kilotwin
