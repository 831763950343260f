/// The types of ROS 2 that doors read and publish, as idlc names them, and how their topics are announced.
#pragma once

#include <string>

#include "core/dds/dds.hpp"
#include "ros2.h"

namespace kilotwin::doors::ros2 {

using Time = builtin_interfaces_msg_dds__Time_;
using Header = std_msgs_msg_dds__Header_;
using Pose = geometry_msgs_msg_dds__Pose_;
using PoseStamped = geometry_msgs_msg_dds__PoseStamped_;
using PoseArray = geometry_msgs_msg_dds__PoseArray_;
using PoseWithCovarianceStamped = geometry_msgs_msg_dds__PoseWithCovarianceStamped_;
using TFMessage = tf2_msgs_msg_dds__TFMessage_;
using Clock = rosgraph_msgs_msg_dds__Clock_;
using NamedPoseArray = motion_capture_tracking_interfaces_msg_dds__NamedPoseArray_;
using RigidBodies = mocap4r2_msgs_msg_dds__RigidBodies_;

/// RIHS01 hash of a type: SHA-256 over its description (ROS enhancement proposal 2016). ROS prints a warning about endpoints
/// that state none. tests/clients/doors/ros2 computes the hashes again from the message definitions.
template <class T> const char* type_hash();
template <> inline const char* type_hash<PoseStamped>() {
  return "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8";
}
template <> inline const char* type_hash<PoseWithCovarianceStamped>() {
  return "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e";
}
template <> inline const char* type_hash<PoseArray>() {
  return "RIHS01_af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0";
}
template <> inline const char* type_hash<TFMessage>() {
  return "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";
}
template <> inline const char* type_hash<Clock>() {
  return "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564";
}
template <> inline const char* type_hash<NamedPoseArray>() {
  return "RIHS01_d4c89ff7e0670d5f83b0322513e1c8dc2c3b279a68495daa026c352f0027e5f2";
}
template <> inline const char* type_hash<RigidBodies>() {
  return "RIHS01_1f2d74f2a1706c59639a2349b7be91e9e4d751fad6fc3048c59d8f1f0576ea70";
}

/// Of the participant: the security enclave, which the graph of ROS shows.
inline constexpr const char* kEnclave = "enclave=/;";

/// The DDS topic of the ROS topic `name` (absolute, "/poses").
template <class T> dds::Channel channel(const std::string& name, dds::Delivery delivery) {
  return {"rt" + name, delivery, "", std::string{"typehash="} + type_hash<T>() + ";"};
}

}  // namespace kilotwin::doors::ros2

namespace kilotwin::dds {
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::PoseStamped>() {
  return &geometry_msgs_msg_dds__PoseStamped__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::PoseArray>() {
  return &geometry_msgs_msg_dds__PoseArray__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::PoseWithCovarianceStamped>() {
  return &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::TFMessage>() {
  return &tf2_msgs_msg_dds__TFMessage__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::Clock>() {
  return &rosgraph_msgs_msg_dds__Clock__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::NamedPoseArray>() {
  return &motion_capture_tracking_interfaces_msg_dds__NamedPoseArray__desc;
}
template <> inline const dds_topic_descriptor_t* descriptor<doors::ros2::RigidBodies>() {
  return &mocap4r2_msgs_msg_dds__RigidBodies__desc;
}
}  // namespace kilotwin::dds
