#include "clients/identify/data/command_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kilotwin::identify {
namespace {

bool is_turn(Motion motion) { return motion == Motion::kLeft || motion == Motion::kRight; }

}  // namespace

void CommandState::advance(double by_s) {
  since_s += by_s;
  if (left_on()) motor_s[0] += by_s;
  if (right_on()) motor_s[1] += by_s;
  if (driven()) driven_s += by_s;
  since_rest_s = driven() ? since_rest_s + by_s : 0;
}

double CommandState::discounted_s(std::size_t decay_index, std::size_t motor) const {
  const double span_s = kDecayTimes_s[decay_index], kept = std::exp(-since_s / span_s);
  const bool on = motor == 0 ? left_on() : motor == 1 ? right_on() : driven();
  return initial_discounted_s[decay_index][motor] * kept + (on ? span_s * (1 - kept) : 0);
}

CommandClock::CommandClock(const Track& track, double lag_s) {
  CommandState state;
  auto left = state.initial_discounted_s;
  double now_s = 0;
  for (const CommandChange& change : track.commands) {
    const double at_s =
        starts_s_.empty() ? std::max(change.time_s, 0.0) : std::max({change.time_s + lag_s, starts_s_.back(), 0.0});
    if (!starts_s_.empty()) state.advance(at_s - now_s);
    now_s = at_s;
    for (std::size_t f = 0; f < kDecayTimes_s.size(); ++f)
      for (std::size_t motor = 0; motor < 3; ++motor) left[f][motor] = state.discounted_s(f, motor);
    state.initial_discounted_s = left;
    state.first = starts_s_.empty() || starts_s_.front() == at_s;
    state.previous_lasted_s = state.first ? 0 : state.since_s;
    state.previous = state.command;
    if (is_turn(state.command)) state.earlier_turn = state.command;
    if (change.motion != state.command) ++state.count;
    if (state.first) {
      // Commands before the start of the track collapse: the last one is the first.
      state.earlier_turn = Motion::kStop;
      state.count = change.motion != Motion::kStop ? 1 : 0;
    }
    state.command = change.motion;
    state.since_s = 0;
    if (is_turn(change.motion)) state.last_turn = change.motion;
    if (!starts_s_.empty() && starts_s_.back() == at_s) {
      states_.back() = state;  // of two commands at one time the last counts
      continue;
    }
    starts_s_.push_back(at_s);
    states_.push_back(state);
  }
}

std::size_t CommandClock::piece(double time_s) const {
  const auto next = std::upper_bound(starts_s_.begin(), starts_s_.end(), time_s);
  return next == starts_s_.begin() ? 0 : static_cast<std::size_t>(next - starts_s_.begin()) - 1;
}

CommandState CommandClock::at(double time_s) const {
  const std::size_t p = piece(time_s);
  CommandState state = states_[p];
  state.advance(std::max(0.0, time_s - starts_s_[p]));
  return state;
}

double CommandClock::next_change_s(double after_s) const {
  const auto next = std::upper_bound(starts_s_.begin(), starts_s_.end(), after_s);
  return next == starts_s_.end() ? std::numeric_limits<double>::infinity() : *next;
}

}  // namespace kilotwin::identify
