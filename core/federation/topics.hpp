/// All DDS topics of the project: type, name and delivery.
#pragma once

#include "core/dds/dds.hpp"
#include "frames.h"
#include "public.h"
#include "session.h"

namespace kilotwin {

// Types of idl/, with the names that idlc generates.
using WireBodyFrame = kilotwin_wire_BodyFrame;
using WireActuationFrame = kilotwin_wire_ActuationFrame;
using WireRadioFrame = kilotwin_wire_RadioFrame;
using WireTrackingFrame = kilotwin_wire_TrackingFrame;
using WireOverheadFrame = kilotwin_wire_OverheadFrame;
using WireMember = kilotwin_wire_Member;
using WireDirective = kilotwin_wire_Directive;
using WireMetrics = kilotwin_wire_Metrics;
using PublicRunControl = kilotwin_open_RunControl;
using PublicRelocation = kilotwin_open_Relocation;
using PublicOverheadPacket = kilotwin_open_OverheadPacket;
using PublicStationPacket = kilotwin_open_StationPacket;
using PublicTrackerFrame = kilotwin_open_TrackerFrame;
using PublicHeardMessage = kilotwin_open_HeardMessage;
using PublicRunStatus = kilotwin_open_RunStatus;
using PublicRobotState = kilotwin_open_RobotState;
using PublicRunDescription = kilotwin_open_RunDescription;
using PublicSwarmState = kilotwin_open_SwarmState;

namespace topics {

using dds::Channel;
using dds::Delivery;

/// Poses of the robots that a partition owns, for the radio and the station, and for hosts if RunPlan::hosts_see_bodies().
inline Channel bodies() { return {"kilotwin/bodies", Delivery::kFrame, ""}; }
/// Bodies near the border, only for partition `to`.
inline Channel ghosts(std::uint32_t to) {
  return {"kilotwin/ghosts", Delivery::kFrame, "to." + std::to_string(to)};
}
inline Channel actuation() { return {"kilotwin/actuation", Delivery::kFrame, ""}; }
/// Receptions, clocks and requests for messages, only for host `to`.
inline Channel radio(std::uint32_t to) { return {"kilotwin/radio", Delivery::kFrame, "to." + std::to_string(to)}; }
/// Poses of tracked robots, from the station to physics and hosts, where RunPlan::any_tracked().
inline Channel tracking() { return {"kilotwin/tracking", Delivery::kFrame, ""}; }
inline Channel overhead() { return {"kilotwin/overhead", Delivery::kFrame, ""}; }

inline Channel members() { return {"kilotwin/members", Delivery::kMembership, ""}; }
inline Channel directives() { return {"kilotwin/directives", Delivery::kLog, ""}; }
inline Channel metrics() { return {"kilotwin/metrics", Delivery::kLog, ""}; }

inline Channel run_control() { return {"kilotwin/run_control", Delivery::kRequest, ""}; }
inline Channel relocations() { return {"kilotwin/relocations", Delivery::kRequest, ""}; }
inline Channel overhead_packets() { return {"kilotwin/overhead_packets", Delivery::kRequest, ""}; }
inline Channel station_packets() { return {"kilotwin/station_packets", Delivery::kRequest, ""}; }
inline Channel tracker_frames() { return {"kilotwin/tracker_frames", Delivery::kSensor, ""}; }
/// The same topic, for readers that know writers that repeat what was lost.
inline Channel played_frames() { return {"kilotwin/tracker_frames", Delivery::kPlayback, ""}; }
inline Channel heard_messages() { return {"kilotwin/heard_messages", Delivery::kPlayback, ""}; }
inline Channel run_status() { return {"kilotwin/run_status", Delivery::kStatus, ""}; }
inline Channel robots() { return {"kilotwin/robots", Delivery::kTelemetry, ""}; }
inline Channel run_description() { return {"kilotwin/run_description", Delivery::kStatus, ""}; }
inline Channel swarm() { return {"kilotwin/swarm", Delivery::kTelemetry, ""}; }

}  // namespace topics

namespace dds {
template <> inline const dds_topic_descriptor_t* descriptor<WireBodyFrame>() {
  return &kilotwin_wire_BodyFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireActuationFrame>() {
  return &kilotwin_wire_ActuationFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireRadioFrame>() {
  return &kilotwin_wire_RadioFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireOverheadFrame>() {
  return &kilotwin_wire_OverheadFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireTrackingFrame>() {
  return &kilotwin_wire_TrackingFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireMember>() { return &kilotwin_wire_Member_desc; }
template <> inline const dds_topic_descriptor_t* descriptor<WireDirective>() {
  return &kilotwin_wire_Directive_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<WireMetrics>() { return &kilotwin_wire_Metrics_desc; }
template <> inline const dds_topic_descriptor_t* descriptor<PublicRunControl>() {
  return &kilotwin_open_RunControl_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicRelocation>() {
  return &kilotwin_open_Relocation_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicOverheadPacket>() {
  return &kilotwin_open_OverheadPacket_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicStationPacket>() {
  return &kilotwin_open_StationPacket_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicTrackerFrame>() {
  return &kilotwin_open_TrackerFrame_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicHeardMessage>() {
  return &kilotwin_open_HeardMessage_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicRunStatus>() {
  return &kilotwin_open_RunStatus_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicRobotState>() {
  return &kilotwin_open_RobotState_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicRunDescription>() {
  return &kilotwin_open_RunDescription_desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<PublicSwarmState>() {
  return &kilotwin_open_SwarmState_desc;
}
}  // namespace dds

}  // namespace kilotwin
