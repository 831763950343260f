#include "clients/foxglove/topics.hpp"

#include <google/protobuf/descriptor.pb.h>

#include <cmath>
#include <cstring>
#include <numeric>
#include <set>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "idl/counters.pb.h"
#include "idl/foxglove.pb.h"

namespace kilotwin::foxglove {
namespace pb = ::foxglove;
namespace {

constexpr double kMetres = 1e-3;  // per mm
constexpr const char* kFrame = "arena";
constexpr std::size_t kLogLines = 64;

struct Paint {
  double r, g, b, a;
};
constexpr Paint kWall{0.17, 0.2, 0.25, 1}, kObstacle{0.55, 0.58, 0.63, 1}, kMovable{0.91, 0.85, 0.71, 1};

/// The message's file and all files that it imports, each after what it needs.
void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& known,
              google::protobuf::FileDescriptorSet& files) {
  if (!known.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), known, files);
  file.CopyTo(files.add_file());
}

template <class Message> std::uint16_t add_channel(Sink& sink, std::string_view topic, std::size_t matter = 1) {
  const google::protobuf::Descriptor& descriptor = *Message::descriptor();
  std::set<std::string> known;
  google::protobuf::FileDescriptorSet files;
  add_file(*descriptor.file(), known, files);
  return sink.add_channel(topic, descriptor.full_name(), files.SerializeAsString(), matter);
}

void set(google::protobuf::Timestamp* stamp, Time_ns time) {
  constexpr Time_ns kSecond = 1'000'000'000;
  stamp->set_seconds(static_cast<std::int64_t>(time / kSecond));
  stamp->set_nanos(static_cast<std::int32_t>(time % kSecond));
}

void set(pb::Pose* pose, double x_mm, double y_mm, double z_mm, double heading_rad) {
  pose->mutable_position()->set_x(x_mm * kMetres);
  pose->mutable_position()->set_y(y_mm * kMetres);
  pose->mutable_position()->set_z(z_mm * kMetres);
  pose->mutable_orientation()->set_z(std::sin(heading_rad / 2));
  pose->mutable_orientation()->set_w(std::cos(heading_rad / 2));
}

void set(pb::Color* colour, const Paint& paint) {
  colour->set_r(paint.r);
  colour->set_g(paint.g);
  colour->set_b(paint.b);
  colour->set_a(paint.a);
}

pb::SceneEntity* add_entity(pb::SceneUpdate& scene, Time_ns time, const char* id) {
  pb::SceneEntity* const entity = scene.add_entities();
  set(entity->mutable_timestamp(), time);
  entity->set_frame_id(kFrame);
  entity->set_id(id);
  return entity;
}

void add_point(google::protobuf::RepeatedPtrField<pb::Point3>* points, Point2 at, double z_mm = 0) {
  pb::Point3* const point = points->Add();
  point->set_x(at.x_mm * kMetres);
  point->set_y(at.y_mm * kMetres);
  point->set_z(z_mm * kMetres);
}

/// An upright body: a cylinder, or the upper face of a prism with its outline.
void add_body(pb::SceneEntity* entity, const Convex& shape, const Pose& pose, double height_mm,
              const Paint& paint) {
  if (shape.is_disc()) {
    pb::CylinderPrimitive* const cylinder = entity->add_cylinders();
    set(cylinder->mutable_pose(), pose.x_mm, pose.y_mm, height_mm / 2, pose.heading_rad);
    cylinder->mutable_size()->set_x(2 * shape.radius_mm() * kMetres);
    cylinder->mutable_size()->set_y(2 * shape.radius_mm() * kMetres);
    cylinder->mutable_size()->set_z(height_mm * kMetres);
    cylinder->set_bottom_scale(1);
    cylinder->set_top_scale(1);
    set(cylinder->mutable_color(), paint);
    return;
  }
  pb::TriangleListPrimitive* const face = entity->add_triangles();
  pb::LinePrimitive* const rim = entity->add_lines();
  set(face->mutable_pose(), pose.x_mm, pose.y_mm, height_mm, pose.heading_rad);
  set(rim->mutable_pose(), pose.x_mm, pose.y_mm, height_mm, pose.heading_rad);
  set(face->mutable_color(), paint);
  set(rim->mutable_color(), kWall);
  rim->set_type(pb::LinePrimitive::LINE_LOOP);
  rim->set_thickness(3 * kMetres);
  const std::vector<Point2>& corners = shape.corners();
  for (const Point2 corner : corners) add_point(rim->mutable_points(), corner);
  for (std::size_t i = 2; i < corners.size(); ++i) {
    for (const Point2 corner : {corners[0], corners[i - 1], corners[i]}) add_point(face->mutable_points(), corner);
  }
}

std::vector<Point2> edge_of(const ArenaShape& arena) {
  if (arena.kind() == ArenaShape::Kind::kPolygon) return arena.corners();
  const double w = arena.half_width_mm(), h = arena.half_height_mm();
  if (arena.kind() == ArenaShape::Kind::kRectangle) return {{-w, -h}, {w, -h}, {w, h}, {-w, h}};
  constexpr int kCorners = 96;
  std::vector<Point2> corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * kPi * i / kCorners;
    corners.push_back({arena.radius_mm() * std::cos(angle), arena.radius_mm() * std::sin(angle)});
  }
  return corners;
}

}  // namespace

Topics::Topics(Sink& sink, World world)
    : sink_(sink),
      world_(std::move(world)),
      scene_(add_channel<pb::SceneUpdate>(sink, "/scene")),
      robots_(add_channel<pb::PointCloud>(sink, "/robots")),
      poses_(add_channel<pb::PosesInFrame>(sink, "/poses")),
      counters_(add_channel<mcap::SwarmCounters>(sink, "/counters")),
      log_(add_channel<pb::Log>(sink, "/log", kLogLines)) {}

void Topics::state(const State& state) {
  if (!any_) {
    first_x_mm_.assign(state.x_mm.begin(), state.x_mm.end());
    first_y_mm_.assign(state.y_mm.begin(), state.y_mm.end());
  }
  if (!any_ || !world_.movables.empty()) write_scene(state);
  any_ = true;
  write_robots(state);
  write_poses(state);
  write_counters(state);
}

void Topics::write(std::uint16_t channel, Time_ns time, const google::protobuf::Message& message) {
  message.SerializeToString(&bytes_);
  sink_.write(channel, time, bytes_);
}

/// All of the scene in one message, so that the newest is enough for a viewer that comes later.
void Topics::write_scene(const State& state) {
  pb::SceneUpdate scene;
  pb::SceneEntity* const arena = add_entity(scene, state.time, "arena");
  pb::LinePrimitive* const wall = arena->add_lines();
  wall->set_type(pb::LinePrimitive::LINE_LOOP);
  wall->mutable_pose()->mutable_orientation()->set_w(1);
  wall->set_thickness(5 * kMetres);
  set(wall->mutable_color(), kWall);
  for (const Point2 corner : edge_of(world_.arena)) add_point(wall->mutable_points(), corner);
  pb::SceneEntity* const obstacles = add_entity(scene, state.time, "obstacles");
  for (const ObstacleBody& body : world_.obstacles) {
    add_body(obstacles, body.shape, {body.place.x_mm, body.place.y_mm, body.heading_rad}, body.height_mm,
             kObstacle);
  }
  if (!world_.movables.empty()) {
    pb::SceneEntity* const entity = add_entity(scene, state.time, "movables");
    for (std::size_t i = 0; i < state.movable_x_mm.size(); ++i) {
      const MovableBodyModel& body = world_.movables[i];
      add_body(entity, body.shape, {state.movable_x_mm[i], state.movable_y_mm[i], state.movable_heading_rad[i]},
               body.height_mm, kMovable);
    }
  }
  write(scene_, state.time, scene);
}

void Topics::write_robots(const State& state) {
  struct Point {
    float x, y, z;
    std::uint8_t red, green, blue, alpha;
  };
  pb::PointCloud cloud;
  set(cloud.mutable_timestamp(), state.time);
  cloud.set_frame_id(kFrame);
  cloud.mutable_pose()->mutable_orientation()->set_w(1);
  cloud.set_point_stride(sizeof(Point));
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "red", "green", "blue", "alpha"}) {
    pb::PackedElementField* const field = cloud.add_fields();
    const bool place = offset < 3 * sizeof(float);
    field->set_name(name);
    field->set_offset(offset);
    field->set_type(place ? pb::PackedElementField::FLOAT32 : pb::PackedElementField::UINT8);
    offset += place ? std::uint32_t{sizeof(float)} : 1u;
  }
  std::string& data = *cloud.mutable_data();
  data.resize(sizeof(Point) * state.x_mm.size());
  for (std::size_t i = 0; i < state.x_mm.size(); ++i) {
    const auto led = state.led[i];
    const auto part = [led](int shift) { return static_cast<std::uint8_t>(85 * (led >> shift & 3)); };
    constexpr std::uint8_t kDark = 150;
    Point point{static_cast<float>(state.x_mm[i] * kMetres),
                static_cast<float>(state.y_mm[i] * kMetres),
                0.0f,
                part(0),
                part(2),
                part(4),
                255};
    if (led == 0) point.red = point.green = point.blue = kDark;
    std::memcpy(data.data() + sizeof(Point) * i, &point, sizeof point);
  }
  write(robots_, state.time, cloud);
}

void Topics::write_poses(const State& state) {
  pb::PosesInFrame poses;
  set(poses.mutable_timestamp(), state.time);
  poses.set_frame_id(kFrame);
  for (std::size_t i = 0; i < state.x_mm.size(); ++i)
    set(poses.add_poses(), state.x_mm[i], state.y_mm[i], 0, state.heading_rad[i]);
  write(poses_, state.time, poses);
}

void Topics::write_counters(const State& state) {
  mcap::SwarmCounters counters;
  set(counters.mutable_timestamp(), state.time);
  std::uint32_t running = 0, failed = 0;
  for (const std::uint8_t life : state.life_cycle) {
    running += life == static_cast<std::uint8_t>(LifeCycle::kRunning);
    failed += life == static_cast<std::uint8_t>(LifeCycle::kFailed);
  }
  double x = 0, y = 0, square = 0;
  for (std::size_t i = 0; i < state.x_mm.size(); ++i) {
    const double dx = state.x_mm[i] - first_x_mm_[i], dy = state.y_mm[i] - first_y_mm_[i];
    x += state.x_mm[i];
    y += state.y_mm[i];
    square += dx * dx + dy * dy;
  }
  counters.set_robots_running(running);
  counters.set_robots_failed(failed);
  const auto robots = static_cast<double>(state.x_mm.size());
  counters.set_mean_x_mm(x / robots);
  counters.set_mean_y_mm(y / robots);
  counters.set_mean_square_displacement_mm2(square / robots);
  write(counters_, state.time, counters);
}

void Topics::variable(Time_ns time, const std::string& name, std::span<const std::uint32_t> robot,
                      std::span<const double> value) {
  auto channel = variables_.find(name);
  if (channel == variables_.end())
    channel = variables_.emplace(name, add_channel<mcap::RobotVariable>(sink_, "/variables/" + name)).first;
  mcap::RobotVariable message;
  set(message.mutable_timestamp(), time);
  message.mutable_robot()->Add(robot.begin(), robot.end());
  message.mutable_value()->Add(value.begin(), value.end());
  if (!value.empty())
    message.set_mean(std::accumulate(value.begin(), value.end(), 0.0) / static_cast<double>(value.size()));
  write(channel->second, time, message);
}

void Topics::log(Time_ns time, Level level, const std::string& text, std::string_view speaker) {
  pb::Log log;
  set(log.mutable_timestamp(), time);
  log.set_level(level == Level::kError ? pb::Log::ERROR : pb::Log::INFO);
  log.set_message(text);
  log.set_name(std::string{speaker});
  write(log_, time, log);
}

}  // namespace kilotwin::foxglove
