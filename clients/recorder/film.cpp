#include "clients/recorder/film.hpp"

#include <algorithm>
#include <utility>

namespace kilotwin::recorder {
namespace {

/// Number of poses of all robots together; an animation of them has about 1 MB.
constexpr std::size_t kPoses = 60'000;
constexpr std::size_t kFewestFrames = 60, kMostFrames = 240;

std::size_t most_frames(std::size_t robots) {
  return std::clamp(kPoses / std::max<std::size_t>(robots, 1), kFewestFrames, kMostFrames);
}

}  // namespace

Film::Film(std::size_t robots) : small_(robots <= kMostRobots), frames_(most_frames(robots)) {}

void Film::add(const proto::StateRecord& state, TickLength length) {
  if (!small_ || !frames_.wants_next()) return;
  Snapshot frame;
  take(frame, state, length);
  frames_.keep(std::move(frame));
}

}  // namespace kilotwin::recorder
