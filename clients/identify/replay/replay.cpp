#include "clients/identify/replay/replay.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/error.hpp"
#include "core/effects/measurement.hpp"
#include "idl/manifest.pb.h"
#include "services/physics/engine.hpp"

namespace kilotwin::identify {
namespace {

/// Clock ticks of one kilo_tick, 32.768 ms at 8 MHz.
constexpr std::uint32_t kTickCycles = 1 << 18;
constexpr double kTick_s = kTickCycles / 8e6;
/// Motor value while driven: the calibrated duty of the model.
constexpr std::uint8_t kDuty = 70;
constexpr double kRadius_mm = kDiscDiameter_mm / 2;

/// Robots get their index in the scene as number, with their parameters.
proto::Model renumbered(const proto::Model& model, const Scene& scene) {
  std::map<std::uint32_t, std::uint32_t> place_of;
  for (std::uint32_t i = 0; i < scene.robots.size(); ++i) place_of[scene.robots[i].track->robot] = i;
  proto::Model out = model;
  out.clear_robot();
  for (const proto::RobotModel& robot : model.robot()) {
    const auto place = place_of.find(robot.robot());
    if (place == place_of.end()) continue;
    proto::RobotModel& own = *out.add_robot();
    own = robot;
    own.set_robot(place->second);
  }
  for (proto::Effect& effect : *out.mutable_effect()) {
    for (proto::Function& function : *effect.mutable_function()) {
      // An absent robot gets a number that no robot of the scene has: an empty list would mean all robots.
      for (std::uint32_t& robot : *function.mutable_other_robot()) {
        const auto place = place_of.find(robot);
        robot = place != place_of.end() ? place->second : static_cast<std::uint32_t>(scene.robots.size());
      }
      if (function.of() != proto::Function::ROBOT || !function.has_table()) continue;
      proto::Table table;
      if (function.table().has_otherwise()) table.set_otherwise(function.table().otherwise());
      for (int i = 0; i < function.table().key_size(); ++i) {
        const auto place = place_of.find(function.table().key(i));
        if (place == place_of.end()) continue;
        table.add_key(place->second);
        table.add_value(function.table().value(i));
      }
      *function.mutable_table() = table;
    }
  }
  return out;
}

/// A wall as a bar beyond the line of the disc centres. `outwards`: 1 at the upper end of the axis, -1 at the
/// lower.
void add_wall(proto::Experiment& experiment, bool across_x, double line_mm, int outwards, double length_mm) {
  if (!std::isfinite(line_mm)) return;
  // Thickness, so that no robot gets through; the face where robots touch it does not depend on it.
  constexpr double kThick_mm = 200;
  const double middle_mm = line_mm + outwards * (kRadius_mm + kThick_mm / 2);
  proto::Obstacle& wall = *experiment.add_obstacle();
  wall.mutable_box()->set_width_mm(across_x ? kThick_mm : length_mm);
  wall.mutable_box()->set_length_mm(across_x ? length_mm : kThick_mm);
  across_x ? wall.set_x_mm(middle_mm) : wall.set_y_mm(middle_mm);
}

RunPlan plan_of(const Scene& scene, const proto::Model& numbered_otherwise, std::uint64_t seed) {
  const proto::Model model = renumbered(numbered_otherwise, scene);
  proto::Manifest manifest;
  manifest.set_run(1);
  proto::Experiment& e = *manifest.mutable_experiment();
  e.set_seed(seed);
  e.set_duration_s(scene.duration_s() + kTick_s);
  e.set_tick_cycles(kTickCycles);
  e.set_run_number(scene.run);
  *e.mutable_motion() = model.motion();
  *e.mutable_robot_model() = model.robot();
  *e.mutable_effect() = model.effect();
  *e.mutable_field() = model.field();
  e.mutable_physics()->set_engine(scene.contacts ? proto::Physics::PLANAR : proto::Physics::KINEMATIC);
  e.add_robots()->set_count(static_cast<std::uint32_t>(scene.robots.size()));
  manifest.add_program()->set_path("replay");
  manifest.add_group_program(0);
  const Walls& walls = scene.walls;
  double reach_mm = 0;
  for (const double end : {walls.x_low_mm, walls.x_high_mm, walls.y_low_mm, walls.y_high_mm})
    if (std::isfinite(end)) reach_mm = std::max(reach_mm, std::abs(end));
  for (const Scene::Robot& robot : scene.robots) {
    const double x_mm = walls.inside_x(robot.x_mm), y_mm = walls.inside_y(robot.y_mm);
    manifest.add_x_mm(x_mm);
    manifest.add_y_mm(y_mm);
    manifest.add_heading_rad(robot.heading_rad);
    reach_mm = std::max({reach_mm, std::abs(x_mm), std::abs(y_mm)});
  }
  // Sides without a wall are far away.
  const double half_mm = reach_mm + 5000, length_mm = 2 * half_mm;
  e.mutable_arena()->set_width_mm(2 * half_mm);
  e.mutable_arena()->set_height_mm(2 * half_mm);
  if (!scene.contacts) {
    // The kinematic engine only knows the arena's own walls, symmetric about the origin.
    const auto both = [](double low, double high) { return 2 * (std::max(-low, high) + kRadius_mm); };
    if (std::isfinite(walls.x_low_mm + walls.x_high_mm))
      e.mutable_arena()->set_width_mm(both(walls.x_low_mm, walls.x_high_mm));
    if (std::isfinite(walls.y_low_mm + walls.y_high_mm))
      e.mutable_arena()->set_height_mm(both(walls.y_low_mm, walls.y_high_mm));
    return RunPlan(std::move(manifest));
  }
  add_wall(e, true, walls.x_low_mm, -1, length_mm);
  add_wall(e, true, walls.x_high_mm, 1, length_mm);
  add_wall(e, false, walls.y_low_mm, -1, length_mm);
  add_wall(e, false, walls.y_high_mm, 1, length_mm);
  return RunPlan(std::move(manifest));
}

/// Motor frames of the scene's robots, from their commands.
class Motors {
 public:
  explicit Motors(const Scene& scene) : scene_(scene), next_(scene.robots.size(), 0) {
    frame_.motor_left.assign(scene.robots.size(), 0);
    frame_.motor_right = frame_.spin_up = frame_.motor_left;
  }
  /// For the tick that starts at a time. A command change in the first half of the tick holds for the whole tick.
  const ActuationFrame& at(Tick tick, double time_s) {
    frame_.tick = tick;
    const double middle_s = time_s + kTick_s / 2;
    for (std::size_t r = 0; r < next_.size(); ++r) {
      const Track& track = *scene_.robots[r].track;
      const auto begins_s = [&](std::size_t i) {
        return track.commands[i].time_s + (i > 0 ? scene_.command_lag_s : 0);
      };
      while (next_[r] < track.commands.size() && begins_s(next_[r]) < middle_s) ++next_[r];
      const bool seen = track.samples.front().time_s < middle_s;
      const Motion motion = seen && next_[r] > 0 ? track.commands[next_[r] - 1].motion : Motion::kStop;
      // The left motor drives the right-hand wheel.
      frame_.motor_left[r] = motion == Motion::kStraight || motion == Motion::kLeft ? kDuty : 0;
      frame_.motor_right[r] = motion == Motion::kStraight || motion == Motion::kRight ? kDuty : 0;
    }
    return frame_;
  }

 private:
  const Scene& scene_;
  std::vector<std::size_t> next_;  ///< number of commands of each robot that have begun
  ActuationFrame frame_;
};

/// The simulated tracker: measures each robot at its sample times.
class Tracker {
 public:
  Tracker(const Scene& scene, const RunPlan& plan)
      : scene_(scene),
        measurement_(plan),
        swarm_(plan.robots(), plan.movables(), plan.memory.size()),
        next_(scene.robots.size(), 0),
        out_(scene.robots.size()) {
    // Skips samples before the start of the run.
    for (std::size_t r = 0; r < next_.size(); ++r)
      while (next_[r] < samples(r).size() && samples(r)[next_[r]].time_s < 0) ++next_[r];
  }
  /// Measures all samples within the tick that starts at a time, by interpolation from `now` to `then`.
  void look(double time_s, const BodyFrame& now, const BodyFrame& then, const ActuationFrame& motors) {
    for (find_due(time_s + kTick_s); !due_.empty(); find_due(time_s + kTick_s)) {
      between_ = now;
      for (const std::size_t r : due_) {
        const double part = (samples(r)[next_[r]].time_s - time_s) / kTick_s;
        between_.x_mm[r] += part * (then.x_mm[r] - now.x_mm[r]);
        between_.y_mm[r] += part * (then.y_mm[r] - now.y_mm[r]);
        between_.heading_rad[r] =
            wrapped_angle(now.heading_rad[r] + part * wrapped_angle(then.heading_rad[r] - now.heading_rad[r]));
      }
      seen_.x_mm = between_.x_mm;
      seen_.y_mm = between_.y_mm;
      seen_.heading_rad = between_.heading_rad;
      if (measurement_.any()) {
        const BodyFrame* const bodies[] = {&between_};
        const ActuationFrame* const actuation[] = {&motors};
        swarm_.gather(now.tick, bodies);
        swarm_.gather(actuation);
        measurement_.measure(swarm_, seen_);
      }
      for (const std::size_t r : due_) {
        const Sample& measured = samples(r)[next_[r]++];
        out_[r].push_back({measured.time_s, seen_.x_mm[r], seen_.y_mm[r],
                           std::isnan(measured.heading_rad) ? measured.heading_rad : seen_.heading_rad[r]});
      }
    }
  }
  [[nodiscard]] std::vector<std::vector<Sample>> take() { return std::move(out_); }

 private:
  [[nodiscard]] const std::vector<Sample>& samples(std::size_t robot) const {
    return scene_.robots[robot].track->samples;
  }
  /// Finds the robots with a sample before a time.
  void find_due(double before_s) {
    due_.clear();
    for (std::size_t r = 0; r < next_.size(); ++r)
      if (next_[r] < samples(r).size() && samples(r)[next_[r]].time_s < before_s) due_.push_back(r);
  }

  const Scene& scene_;
  Measurement measurement_;
  SwarmView swarm_;
  std::vector<std::size_t> next_, due_;
  BodyFrame between_;
  MeasuredPoses seen_;
  std::vector<std::vector<Sample>> out_;
};

}  // namespace

double Scene::duration_s() const {
  double last_s = 0;
  for (const Robot& robot : robots) last_s = std::max(last_s, robot.track->samples.back().time_s);
  return last_s;
}

double robot_ticks(const Scene& scene) {
  return static_cast<double>(scene.robots.size()) * scene.duration_s() / kTick_s;
}

Scene scene_of(const MotionModel& model, const PreparedSet& set, std::size_t run) {
  Scene scene;
  scene.walls = model.walls;
  scene.contacts = model.contacts;
  for (const TrackView& view : set.views()) {
    if (view.run != run) continue;
    const Sample& first = view.track->samples.front();
    // The pose whose measurement is the first sample, at the estimated heading.
    const bool turned = TrackFilter::has_heading(first);
    Sample seen = first;
    if (!turned)
      seen.heading_rad = model.measured(first.x_mm, first.y_mm, view.start_heading_rad, view.at(first.time_s))[2];
    const Eigen::Vector3d pose = model.pose_of(seen, view.at(first.time_s));
    const double x_mm = pose[0], y_mm = pose[1], heading_rad = pose[2];
    scene.run = view.number;
    scene.command_lag_s = model.base.command_lag_s;
    scene.robots.push_back({view.track, x_mm + model.base.centre_mm * std::cos(heading_rad),
                            y_mm + model.base.centre_mm * std::sin(heading_rad), wrapped_angle(heading_rad)});
  }
  return scene;
}

std::vector<std::vector<Sample>> play(const Scene& scene, const proto::Model& model, std::uint64_t seed) {
  KILOTWIN_DEMAND(!scene.robots.empty() && scene.duration_s() <= kLongestPlay_s);
  const RunPlan plan = plan_of(scene, model, seed);
  const std::unique_ptr<physics::Engine> engine = physics::make_engine(plan, PartitionId{0});
  Motors motors(scene);
  Tracker tracker(scene, plan);
  BodyFrame now, then;
  engine->emit_bodies(now);
  for (Tick tick{0}; tick < plan.last_tick; ++tick) {
    const double time_s = static_cast<double>(tick.count()) * kTick_s;
    const ActuationFrame& actuation = motors.at(tick, time_s);
    const ActuationFrame* const frames[] = {&actuation};
    engine->step(tick, {{}, frames, {}});
    then.clear();
    engine->emit_bodies(then);
    tracker.look(time_s, now, then, actuation);
    std::swap(now, then);
  }
  return tracker.take();
}

}  // namespace kilotwin::identify
