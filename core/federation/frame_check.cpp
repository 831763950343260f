#include "core/federation/frame_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace kilotwin {
namespace {

/// The robots of the host that federate `id` is.
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

bool known(OverheadCommand command) {
  return command == OverheadCommand::kStop || command == OverheadCommand::kRepeat ||
         command == OverheadCommand::kOnce;
}

}  // namespace

const char* defect(const BodyFrame& frame, const RunPlan& plan, FederateId, FederateId) {
  if (!ascending_within(frame.robot, {0, plan.robots()}))
    return "its robots are not ascending ids of the experiment";
  if (!all_finite(frame.x_mm) || !all_finite(frame.y_mm) || !all_finite(frame.heading_rad) ||
      !all_finite(frame.spatial))
    return "a pose is not finite";
  if (frame.memory.size() != frame.robot.size() * plan.memory.size() || !all_finite(frame.memory))
    return "its robots do not remember what the model's effects ask for";
  const MovableColumns& movable = frame.movable;
  if (!ascending_within(movable.body, {0, plan.movables()}))
    return "its movable bodies are not ascending numbers of the experiment";
  for (const auto* column :
       {&movable.x_mm, &movable.y_mm, &movable.heading_rad, &movable.vx_mm, &movable.vy_mm, &movable.turn_rad}) {
    if (!all_finite(*column)) return "a movable body's state is not finite";
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

const char* defect(const OverheadFrame& frame, const RunPlan&, FederateId, FederateId) {
  const auto sound = [](const OverheadPacket& packet) { return known(packet.command); };
  return std::all_of(frame.packets.begin(), frame.packets.end(), sound) ? nullptr : "a packet's command is unknown";
}

const char* defect(const Directive& directive, const RunPlan& plan) {
  if (directive.tick < Tick{0}) return "its tick is negative";
  switch (directive.kind) {
    case DirectiveKind::kPause:
    case DirectiveKind::kContinue:
    case DirectiveKind::kStep:
    case DirectiveKind::kStop:
    case DirectiveKind::kCheckpoint: return nullptr;
    case DirectiveKind::kOverheadInput:
      return known(directive.packet.command) ? nullptr : "its packet's command is unknown";
    case DirectiveKind::kTrackedPose: {
      const TrackedPoseInput& pose = directive.tracked_pose;
      if (pose.robot >= plan.robots() || !plan.tracked(pose.robot)) return "its robot is none that is tracked";
      if (!std::isfinite(pose.x_mm) || !std::isfinite(pose.y_mm) || !std::isfinite(pose.heading_rad))
        return "its pose is not finite";
      return nullptr;
    }
  }
  return "its kind is unknown";
}

}  // namespace kilotwin
