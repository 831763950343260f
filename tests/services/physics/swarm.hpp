/// All partitions of a plan, stepped in one thread with given motors.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/spin_up.hpp"
#include "idl/checkpoint.pb.h"
#include "services/physics/engine.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::testing {

inline constexpr double kTick_s = 0.032768;
/// The default geometry of the drive: idl/model.proto.
inline constexpr double kBase_mm = 25, kOffset_mm = 9.2;
inline const std::string kQuiet = "motion { noise: false } ";

/// Where a tracked robot is from now on.
struct TrackedPlace {
  std::uint32_t robot = 0;
  double x_mm = 0, y_mm = 0, heading_rad = 0;
};

class Swarm {
 public:
  explicit Swarm(const RunPlan& plan)
      : plan_(plan), left_(plan.robots(), 0), right_(plan.robots(), 0), spin_up_(plan.robots(), 0) {
    for (std::uint32_t p = 0; p < plan.grid.size(); ++p)
      engines_.push_back(physics::make_engine(plan, PartitionId{p}));
  }

  void set_motors(std::uint32_t robot, std::uint8_t left, std::uint8_t right) {
    left_[robot] = left;
    right_[robot] = right;
  }
  /// The next step begins with a kick of both motors.
  void kick(std::uint32_t robot) { spin_up_[robot] = kOneSpinUp; }
  void set_all_motors(std::uint8_t left, std::uint8_t right) {
    for (std::uint32_t r = 0; r < plan_.robots(); ++r) set_motors(r, left, right);
  }

  /// `tracked`: by ascending robot.
  void step(const std::vector<TrackedPlace>& tracked = {}, const std::vector<MembershipChange>& memberships = {},
            const std::vector<Relocation>& relocations = {}) {
    TrackingFrame tracking;
    tracking.tick = tick_;
    for (const TrackedPlace& place : tracked) {
      tracking.robot.push_back(place.robot);
      tracking.x_mm.push_back(place.x_mm);
      tracking.y_mm.push_back(place.y_mm);
      tracking.heading_rad.push_back(place.heading_rad);
    }
    // All partitions' ghosts are collected before any partition steps.
    std::map<std::pair<std::uint32_t, std::uint32_t>, BodyFrame> ghosts;
    for (std::uint32_t p = 0; p < engines_.size(); ++p) {
      for (const PartitionId q : engines_[p]->neighbours()) engines_[p]->emit_ghosts(q, ghosts[{p, q.value()}]);
    }
    std::vector<ActuationFrame> frames;
    for (std::uint32_t h = 0; h < plan_.hosts; ++h) {
      const Share share = plan_.share(HostId{h});
      frames.push_back(motors(tick_, {left_.begin() + share.first, left_.begin() + share.last},
                              {right_.begin() + share.first, right_.begin() + share.last}, share.first));
      frames.back().spin_up.assign(spin_up_.begin() + share.first, spin_up_.begin() + share.last);
    }
    spin_up_.assign(spin_up_.size(), 0);
    std::vector<const ActuationFrame*> actuation;
    for (const ActuationFrame& frame : frames) actuation.push_back(&frame);
    for (std::uint32_t p = 0; p < engines_.size(); ++p) {
      std::vector<const BodyFrame*> in;
      for (const auto& [pair, frame] : ghosts) {
        if (pair.second == p) in.push_back(&frame);
      }
      engines_[p]->step(tick_, {in, actuation, &tracking, memberships, relocations});
    }
    ++tick_;
  }
  void run(std::int64_t ticks) {
    for (std::int64_t k = 0; k < ticks; ++k) step();
  }

  /// Poses of all robots; `listed_by` gets the partition of each. Throws if a robot is not listed exactly once.
  [[nodiscard]] std::vector<ScenePose> poses(std::vector<std::uint32_t>* listed_by = nullptr) const {
    std::vector<ScenePose> all(plan_.robots());
    std::vector<std::uint32_t> by(plan_.robots(), kNobody);
    for (std::uint32_t p = 0; p < engines_.size(); ++p) {
      BodyFrame frame;
      engines_[p]->emit_bodies(frame);
      for (std::size_t i = 0; i < frame.robot.size(); ++i) {
        if (i > 0 && frame.robot[i - 1] >= frame.robot[i]) throw std::runtime_error("ids do not ascend");
        if (by[frame.robot[i]] != kNobody) throw std::runtime_error("listed twice");
        by[frame.robot[i]] = p;
        all[frame.robot[i]] = {frame.x_mm[i], frame.y_mm[i], frame.heading_rad[i]};
      }
    }
    for (const std::uint32_t p : by) {
      if (p == kNobody) throw std::runtime_error("listed by nobody");
    }
    if (listed_by != nullptr) *listed_by = by;
    return all;
  }

  /// Poses of all movable bodies. Throws if one is not listed exactly once.
  [[nodiscard]] std::vector<ScenePose> movables() const {
    std::vector<ScenePose> all(plan_.movables());
    std::size_t found = 0;
    for (const auto& engine : engines_) {
      BodyFrame frame;
      engine->emit_bodies(frame);
      for (std::size_t i = 0; i < frame.movable.body.size(); ++i, ++found) {
        all[frame.movable.body[i]] = {frame.movable.x_mm[i], frame.movable.y_mm[i], frame.movable.heading_rad[i]};
      }
    }
    if (found != all.size()) throw std::runtime_error("a movable body is listed twice or by nobody");
    return all;
  }

  [[nodiscard]] std::uint64_t hash() const {
    std::uint64_t sum = 0;
    for (const auto& engine : engines_) sum += engine->hash_part();
    return sum;
  }

  [[nodiscard]] std::vector<proto::PhysicsState> save() const {
    std::vector<proto::PhysicsState> parts(engines_.size());
    for (std::size_t p = 0; p < engines_.size(); ++p) engines_[p]->save(parts[p]);
    return parts;
  }
  void load(Tick tick, const std::vector<proto::PhysicsState>& parts) {
    std::vector<const proto::PhysicsState*> pointers;
    for (const proto::PhysicsState& part : parts) pointers.push_back(&part);
    for (const auto& engine : engines_) engine->load(tick, pointers);
    tick_ = tick;
  }

  [[nodiscard]] physics::Engine& engine(std::uint32_t p) { return *engines_[p]; }
  [[nodiscard]] Tick tick() const { return tick_; }

 private:
  static constexpr std::uint32_t kNobody = 0xffffffffu;

  const RunPlan& plan_;
  std::vector<std::unique_ptr<physics::Engine>> engines_;
  std::vector<std::uint8_t> left_, right_, spin_up_;
  Tick tick_;
};

/// The largest overlap of any two discs, mm; negative: the smallest gap.
inline double largest_overlap_mm(const std::vector<ScenePose>& poses) {
  double largest = -1e300;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      const double dx = poses[i].x_mm - poses[j].x_mm, dy = poses[i].y_mm - poses[j].y_mm;
      const double overlap = 2 * kRobotRadius_mm - __builtin_sqrt(dx * dx + dy * dy);
      if (overlap > largest) largest = overlap;
    }
  }
  return largest;
}

/// Motors that change from time to time: most run straight or turn, some rest.
inline void drive(Swarm& swarm, std::uint32_t robots, std::uint32_t tick) {
  for (std::uint32_t r = 0; r < robots; ++r) {
    const std::uint32_t phase = (r * 2654435761u + tick / 40 * 40503u) >> 7 & 7;
    swarm.set_motors(r, phase < 5 ? 70 : 0, phase < 4 || phase == 6 ? 70 : 0);
  }
}

}  // namespace kilotwin::testing
