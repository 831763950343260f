#include "core/federation/frame_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "core/base/pose.hpp"
#include "core/plan/physics_settings.hpp"

namespace kilotwin {
namespace {

/// The share of the behaviours host with federate id `id`.
Share share_of(const RunPlan& plan, FederateId id) {
  return plan.share(HostId{id.value() - plan.behaviours(HostId{0}).value()});
}

bool ascending_within(const std::vector<std::uint32_t>& robots, Share share) {
  return std::adjacent_find(robots.begin(), robots.end(), std::greater_equal<>()) == robots.end() &&
         (robots.empty() || (share.contains(robots.front()) && share.contains(robots.back())));
}

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

/// Limit of coordinates. Arenas are at most 1e6 mm wide, so no body gets that far.
constexpr double kFarthest_mm = 1e9;

bool all_within(const std::vector<double>& values, double most) {
  return std::all_of(values.begin(), values.end(), [most](double value) { return std::abs(value) <= most; });
}

/// Whether all values are enumerators of LifeCycle.
bool all_life_cycles(const std::vector<std::uint8_t>& values) {
  return std::all_of(values.begin(), values.end(), [](std::uint8_t value) {
    return value <= static_cast<std::uint8_t>(LifeCycle::kMoving) ||
           value >= static_cast<std::uint8_t>(LifeCycle::kAbsent);
  });
}

/// Whether all values are colours with two bits per channel.
bool all_colours(const std::vector<std::uint8_t>& values) {
  return std::all_of(values.begin(), values.end(), [](std::uint8_t value) { return value < 64; });
}

/// Whether the columns are valid rigid-body states of the ODE engine: z, a unit quaternion, velocity, angular velocity.
bool are_rigid_states(std::span<const double> columns) {
  constexpr double kMostMotion = 1e9, kLeastNorm = 0.9, kMostNorm = 1.1;
  for (; !columns.empty(); columns = columns.subspan(BodyFrame::kSpatialColumns)) {
    double square = 0;
    for (const double q : columns.subspan(1, 4)) square += q * q;
    if (!(square >= kLeastNorm && square <= kMostNorm)) return false;
    for (std::size_t i = 0; i < BodyFrame::kSpatialColumns; ++i)
      if (!(std::abs(columns[i]) <= kMostMotion)) return false;
  }
  return true;
}

}  // namespace

const char* defect(const BodyFrame& frame, const RunPlan& plan, FederateId, FederateId reader) {
  if (!ascending_within(frame.robot, {0, plan.robots()}))
    return "its robots are not ascending ids of the experiment";
  if (!all_within(frame.x_mm, kFarthest_mm) || !all_within(frame.y_mm, kFarthest_mm) ||
      !all_within(frame.heading_rad, kPi))
    return "a pose is out of range";
  const bool is_of_ghosts = reader.value() < plan.grid.size();
  const bool has_rigid_states = is_of_ghosts && plan.physics_settings().engine == PhysicsSettings::Engine::kOde;
  const std::size_t bodies = frame.robot.size() + frame.movable.body.size();
  if (frame.spatial.size() != (has_rigid_states ? BodyFrame::kSpatialColumns * bodies : 0) ||
      !are_rigid_states(frame.spatial))
    return "its states in space are none of its bodies";
  if (frame.memory.size() != frame.robot.size() * plan.memory.size() || !all_finite(frame.memory))
    return "its robots do not remember what the model's effects ask for";
  const MovableColumns& movable = frame.movable;
  if (!ascending_within(movable.body, {0, plan.movables()}))
    return "its movable bodies are not ascending numbers of the experiment";
  for (const auto* column :
       {&movable.x_mm, &movable.y_mm, &movable.heading_rad, &movable.vx_mm, &movable.vy_mm, &movable.turn_rad}) {
    if (!all_within(*column, kFarthest_mm)) return "a movable body's state is out of range";
  }
  const ContactColumns& contact = frame.contact;
  if (!std::includes(frame.robot.begin(), frame.robot.end(), contact.robot.begin(), contact.robot.end()) ||
      !ascending_within(contact.robot, {0, plan.robots()}))
    return "its robots with contacts are not ascending robots of the frame";
  if (!all_finite(contact.slip_x_mm) || !all_finite(contact.slip_y_mm) || !all_finite(contact.normal_impulse_mm) ||
      !all_finite(contact.tangent_impulse_mm))
    return "a contact's state is not finite";
  constexpr std::uint32_t kMostWalls = 32;
  const auto obstacles = static_cast<std::uint32_t>(plan.world.obstacles.size());
  const auto known_body = [&](std::uint32_t other) {
    return other < plan.robots() + plan.movables() + obstacles + kMostWalls;
  };
  if (!std::all_of(contact.other.begin(), contact.other.end(), known_body)) return "a contact is with nobody";
  return nullptr;
}

const char* defect(const ActuationFrame& frame, const RunPlan& plan, FederateId publisher, FederateId) {
  const Share share = share_of(plan, publisher);
  if (frame.first_robot != share.first || frame.motor_left.size() != share.size())
    return "it is not of the host's share of robots";
  if (!all_life_cycles(frame.life_cycle)) return "a life cycle is unknown";
  if (!all_colours(frame.led)) return "an LED has no such colour";
  if (!ascending_within(frame.offer_robot, share)) return "it offers messages of robots that are not the host's";
  return nullptr;
}

const char* defect(const RadioFrame& frame, const RunPlan& plan, FederateId, FederateId reader) {
  const Share share = share_of(plan, reader);
  if (frame.first_robot != share.first || frame.kilo_ticks.size() != share.size())
    return "it is not for this host's share of robots";
  if (!ascending_within(frame.ask, share) || !ascending_within(frame.sent, share))
    return "it asks robots that are not this host's";
  const auto runs_firmware = [&](std::uint32_t robot) { return plan.firmware(robot); };
  if (!ascending_within(frame.firmware_robot, share) ||
      !std::all_of(frame.firmware_robot.begin(), frame.firmware_robot.end(), runs_firmware))
    return "it shows firmware robots that are none of this host's";
  if (!all_life_cycles(frame.firmware_life_cycle)) return "a life cycle is unknown";
  if (!all_colours(frame.firmware_led)) return "an LED has no such colour";
  const std::vector<std::uint32_t>& receivers = frame.reception_robot;
  if (!std::is_sorted(receivers.begin(), receivers.end()) ||
      (!receivers.empty() && !(share.contains(receivers.front()) && share.contains(receivers.back())))) {
    return "its receptions are not ordered, or by robots that are not this host's";
  }
  const auto there = [&](std::uint32_t message) { return message < frame.messages.size(); };
  if (!std::all_of(frame.reception_message.begin(), frame.reception_message.end(), there))
    return "a reception names no message";
  return nullptr;
}

const char* defect(const OverheadFrame& frame, const RunPlan& plan, FederateId, FederateId) {
  const auto sound = [](const OverheadPacket& packet) { return is_known(packet.command); };
  if (!std::all_of(frame.packets.begin(), frame.packets.end(), sound)) return "a packet's command is unknown";
  const auto earlier = [](const OverheadPacket& a, const OverheadPacket& b) {
    return a.offset_cycles() < b.offset_cycles();
  };
  if (!std::is_sorted(frame.packets.begin(), frame.packets.end(), earlier))
    return "its packets are not in the order of time";
  if (!frame.packets.empty() && frame.packets.back().offset_cycles() >= plan.tick_length.cycles())
    return "a packet's offset lies beyond the tick";
  return nullptr;
}

const char* defect(const TrackingFrame& frame, const RunPlan& plan, FederateId, FederateId) {
  if (!ascending_within(frame.robot, {0, plan.robots()}) ||
      !std::all_of(frame.robot.begin(), frame.robot.end(),
                   [&](std::uint32_t robot) { return plan.tracked(robot); }))
    return "its robots are not ascending ids of tracked robots";
  if (!ascending_within(frame.said_robot, {0, plan.robots()}) ||
      !std::all_of(frame.said_robot.begin(), frame.said_robot.end(),
                   [&](std::uint32_t robot) { return plan.tracked(robot); }))
    return "its senders are not ascending ids of tracked robots";
  const auto known_state = [](std::uint8_t state) {
    return state <= static_cast<std::uint8_t>(TrackedState::kInDoubt);
  };
  if (!std::all_of(frame.state.begin(), frame.state.end(), known_state)) return "a robot's state is unknown";
  if (!all_within(frame.x_mm, kFarthest_mm) || !all_within(frame.y_mm, kFarthest_mm) ||
      !all_within(frame.heading_rad, kPi))
    return "a pose is out of range";
  const auto colour = [](std::uint8_t led) { return led < 64 || led == kUnknownLed; };
  return std::all_of(frame.led.begin(), frame.led.end(), colour) ? nullptr : "an LED has no such colour";
}

const char* defect(const Relocation& relocation, const RunPlan& plan) {
  const auto& [movable, body, pose] = relocation;
  if (!std::isfinite(pose.x_mm) || !std::isfinite(pose.y_mm) ||
      !(pose.heading_rad >= -kPi && pose.heading_rad < kPi))
    return "its pose is no pose";
  if (body >= (movable ? plan.movables() : plan.robots())) return "its body does not exist";
  if (!movable && plan.tracked(body)) return "its robot is a real one, which no simulation moves";
  if (!movable && plan.cell_side_mm(body) > 0) return "its robot is a cell of the floor, which nothing moves";
  const Convex shape = movable ? plan.world.movables[body].shape : Convex::disc(kRobotRadius_mm);
  const Place place = Place::at(pose.x_mm, pose.y_mm, pose.heading_rad);
  if (plan.world.arena.clearance_mm(shape, place) < 0) return "its place is not within the arena";
  for (const ObstacleBody& obstacle : plan.world.obstacles) {
    if (separation_mm(shape, place, obstacle.shape, obstacle.place) < 0) return "its place overlaps an obstacle";
  }
  return nullptr;
}

const char* defect(const Directive& directive, const RunPlan& plan) {
  if (directive.tick < Tick{0}) return "its tick is negative";
  if (directive.tick > plan.last_tick + kAnnounceAhead) return "its tick lies after the run's end";
  switch (directive.kind) {
    case DirectiveKind::kPause:
    case DirectiveKind::kContinue:
    case DirectiveKind::kStep:
    case DirectiveKind::kStop:
    case DirectiveKind::kCheckpoint: return nullptr;
    case DirectiveKind::kOverheadInput:
      if (!is_known(directive.packet.command)) return "its packet's command is unknown";
      return directive.packet.offset_cycles() < plan.tick_length.cycles()
                 ? nullptr
                 : "its packet's offset lies beyond the tick";
    case DirectiveKind::kMembership: {
      const std::uint32_t robot = directive.membership.robot;
      if (robot >= plan.robots() || !plan.tracked(robot)) return "its robot is none that is tracked";
      return directive.membership.membership <= Membership::kLost ? nullptr : "its membership is unknown";
    }
    case DirectiveKind::kRelocation: return defect(directive.relocation, plan);
  }
  return "its kind is unknown";
}

}  // namespace kilotwin
