#include "clients/identify/design/tracked_plan.hpp"

#include <algorithm>
#include <cmath>

#include "clients/identify/replay/replay.hpp"

namespace kilotwin::identify {
namespace {

/// Number of the run: none of those in the data, because nobody knows how a new run differs from them.
constexpr std::uint32_t kNewRun = 9999;

bool is_tracker_noise(const proto::Effect& effect) {
  return effect.acts_on() >= proto::Effect::MEASURED_OFFSET &&
         std::any_of(effect.function().begin(), effect.function().end(),
                     [](const proto::Function& f) { return f.has_noise() || f.has_episodes(); });
}

/// The samples to take; positions are those of the simulated tracker.
Track track_of(const PlannedRobot& robot, double duration_s, double every_s) {
  Track track;
  track.robot = robot.robot;
  // The last tick has no later one to interpolate to.
  const double last_s = duration_s - 2 * kPlanTick_s;
  const auto samples = static_cast<std::size_t>(std::floor(last_s / every_s)) + 1;
  for (std::size_t k = 0; k < samples; ++k) track.samples.push_back({static_cast<double>(k) * every_s, 0, 0, 0});
  track.commands.push_back({-1e300, Motion::kStop});
  for (const PlannedCommand& c : robot.commands)
    track.commands.push_back({static_cast<double>(c.tick) * kPlanTick_s, c.motion});
  return track;
}

}  // namespace

proto::Model without_tracker_noise(const proto::Model& model) {
  proto::Model out = model;
  out.clear_effect();
  for (const proto::Effect& effect : model.effect())
    if (!is_tracker_noise(effect)) *out.add_effect() = effect;
  return out;
}

bool couples_robots(const proto::Model& model) {
  using proto::Function;
  const auto of_others = [](Function::Covariate c) {
    return (c >= Function::NEIGHBOURS && c <= Function::NEAREST_BEARING) || c == Function::PLACE;
  };
  return std::any_of(model.effect().begin(), model.effect().end(), [&](const proto::Effect& effect) {
    return std::any_of(effect.function().begin(), effect.function().end(),
                       [&](const Function& f) { return of_others(f.of()) || of_others(f.and_of()); });
  });
}

PlanTracks play_plan(const RecordingPlan& plan, const proto::Model& model, double every_s, bool contacts,
                     std::uint64_t seed) {
  std::vector<Track> tracks;
  for (const PlannedRobot& robot : plan.robots) tracks.push_back(track_of(robot, plan.duration_s(), every_s));
  Scene scene;
  constexpr double kRadius_mm = kDiscDiameter_mm / 2;
  scene.walls.x_high_mm = plan.arena.width_mm / 2 - kRadius_mm;
  scene.walls.y_high_mm = plan.arena.height_mm / 2 - kRadius_mm;
  scene.walls.x_low_mm = -scene.walls.x_high_mm;
  scene.walls.y_low_mm = -scene.walls.y_high_mm;
  scene.contacts = contacts;
  scene.run = kNewRun;
  for (std::size_t r = 0; r < tracks.size(); ++r) {
    const PlannedRobot& robot = plan.robots[r];
    scene.robots.push_back({&tracks[r], robot.x_mm, robot.y_mm, robot.heading_rad});
  }
  return play(scene, model, seed);
}

}  // namespace kilotwin::identify
