// Ghosts of a region's radio engine: what it sends to neighbours, and reads from them.
#include "core/base/error.hpp"
#include "services/comm/radio_engine.hpp"

namespace kilotwin::comm {
namespace {

/// Within a tick, a sender makes its neighbours wait, and their waiting decides who sends next. Chains of up to this number of
/// links, each of one reach, are computed exactly across a border. A robot has one interrupt per tick, and a packet takes
/// an eighth of a tick; longer chains through distinct robots in order of time arise only by design.
constexpr double kHops = 4;
/// Upper bound of a body's motion within a tick, mm.
constexpr double kMostMove_mm = 20;

}  // namespace

double RadioEngine::ghost_margin_mm() const { return kHops * links_.reach_mm() + kMostMove_mm; }

void RadioEngine::emit_ghosts(const Region& to, RadioGhosts& ghosts) const {
  ghosts.clear();
  const auto matters = [&](std::uint32_t i) {
    return owns(i) && to.is_near(neighbourhood_.x_mm(i), neighbourhood_.y_mm(i), ghost_margin_mm());
  };
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    if (!matters(i)) continue;
    ghosts.robot.push_back(i);
    ghosts.time_word.push_back(timers_.time_word(i));
    ghosts.count_word.push_back(timers_.count_word(i));
    ghosts.state.push_back(state_[i]);
    ghosts.tx_period.push_back(tx_period_[i]);
    ghosts.message.push_back(message_[i]);
    ghosts.crc_error.push_back(crc_error_[i]);
    ghosts.next_send.push_back(simple_ ? next_send_[i] : 0);
  }
  for (const Transmission& x : channel_.all()) {
    if (matters(x.sender)) ghosts.transmissions.push_back(x);
  }
}

void RadioEngine::take_ghosts(std::span<const RadioGhosts* const> frames) {
  std::vector<Transmission>& transmissions = channel_.all();
  std::erase_if(transmissions, [&](const Transmission& x) { return !owns(x.sender); });
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    if (!owns(i)) state_[i] = 0;
  }
  known_ = owned_;
  for (const RadioGhosts* frame : frames) {
    for (std::size_t n = 0; n < frame->robot.size(); ++n) {
      const std::uint32_t i = frame->robot[n];
      KILOTWIN_DEMAND(i < state_.size() && !owns(i));
      known_[i] = 1;
      timers_.restore(i, frame->time_word[n], frame->count_word[n]);
      state_[i] = frame->state[n];
      tx_period_[i] = frame->tx_period[n];
      message_[i] = frame->message[n];
      crc_error_[i] = frame->crc_error[n];
      if (simple_) next_send_[i] = frame->next_send[n];
    }
    transmissions.insert(transmissions.end(), frame->transmissions.begin(), frame->transmissions.end());
  }
}

/// Decides ownership from current positions. A robot that enters the region must have been a ghost.
void RadioEngine::update_ownership() {
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    owned_[i] = region_.contains(neighbourhood_.x_mm(i), neighbourhood_.y_mm(i));
    KILOTWIN_DEMAND(!owned_[i] || known_[i]);
    if (!known_[i]) state_[i] = 0;
  }
}

}  // namespace kilotwin::comm
