#include "clients/mcap/export_mcap.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>

#include <cmath>
#include <cstring>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clients/mcap/mcap_writer.hpp"
#include "core/base/error.hpp"
#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "core/plan/world.hpp"
#include "idl/counters.pb.h"
#include "idl/foxglove.pb.h"

namespace kilotwin::mcap {
namespace {

constexpr double kMetres = 1e-3;  // per mm
constexpr const char* kFrame = "arena";

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

template <class Message> std::uint16_t add_channel(McapWriter& out, const char* topic) {
  const google::protobuf::Descriptor& descriptor = *Message::descriptor();
  std::set<std::string> known;
  google::protobuf::FileDescriptorSet files;
  add_file(*descriptor.file(), known, files);
  const std::uint16_t schema = out.add_schema(descriptor.full_name(), "protobuf", files.SerializeAsString());
  return out.add_channel(schema, topic, "protobuf");
}

void set(google::protobuf::Timestamp* stamp, Time_ns time) {
  constexpr Time_ns kSecond = 1'000'000'000;
  stamp->set_seconds(static_cast<std::int64_t>(time / kSecond));
  stamp->set_nanos(static_cast<std::int32_t>(time % kSecond));
}

void set(foxglove::Pose* pose, double x_mm, double y_mm, double z_mm, double heading_rad) {
  pose->mutable_position()->set_x(x_mm * kMetres);
  pose->mutable_position()->set_y(y_mm * kMetres);
  pose->mutable_position()->set_z(z_mm * kMetres);
  pose->mutable_orientation()->set_z(std::sin(heading_rad / 2));
  pose->mutable_orientation()->set_w(std::cos(heading_rad / 2));
}

void set(foxglove::Color* colour, const Paint& paint) {
  colour->set_r(paint.r);
  colour->set_g(paint.g);
  colour->set_b(paint.b);
  colour->set_a(paint.a);
}

foxglove::SceneEntity* add_entity(foxglove::SceneUpdate& scene, Time_ns time, const char* id) {
  foxglove::SceneEntity* const entity = scene.add_entities();
  set(entity->mutable_timestamp(), time);
  entity->set_frame_id(kFrame);
  entity->set_id(id);
  return entity;
}

void add_point(google::protobuf::RepeatedPtrField<foxglove::Point3>* points, Point2 at, double z_mm = 0) {
  foxglove::Point3* const point = points->Add();
  point->set_x(at.x_mm * kMetres);
  point->set_y(at.y_mm * kMetres);
  point->set_z(z_mm * kMetres);
}

/// An upright body: a cylinder, or the upper face of a prism with its outline.
void add_body(foxglove::SceneEntity* entity, const Convex& shape, const Pose& pose, double height_mm,
              const Paint& paint) {
  if (shape.is_disc()) {
    foxglove::CylinderPrimitive* const cylinder = entity->add_cylinders();
    set(cylinder->mutable_pose(), pose.x_mm, pose.y_mm, height_mm / 2, pose.heading_rad);
    cylinder->mutable_size()->set_x(2 * shape.radius_mm() * kMetres);
    cylinder->mutable_size()->set_y(2 * shape.radius_mm() * kMetres);
    cylinder->mutable_size()->set_z(height_mm * kMetres);
    cylinder->set_bottom_scale(1);
    cylinder->set_top_scale(1);
    set(cylinder->mutable_color(), paint);
    return;
  }
  foxglove::TriangleListPrimitive* const face = entity->add_triangles();
  foxglove::LinePrimitive* const rim = entity->add_lines();
  set(face->mutable_pose(), pose.x_mm, pose.y_mm, height_mm, pose.heading_rad);
  set(rim->mutable_pose(), pose.x_mm, pose.y_mm, height_mm, pose.heading_rad);
  set(face->mutable_color(), paint);
  set(rim->mutable_color(), kWall);
  rim->set_type(foxglove::LinePrimitive::LINE_LOOP);
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

World world_of(const proto::RecordingHeader& header) {
  proto::Experiment experiment;
  if (header.has_arena()) {
    *experiment.mutable_arena() = header.arena();
  } else {
    experiment.mutable_arena()->set_width_mm(header.arena_width_mm());
    experiment.mutable_arena()->set_height_mm(header.arena_height_mm());
  }
  *experiment.mutable_obstacle() = header.obstacle();
  *experiment.mutable_movable() = header.movable();
  return World(experiment);
}

/// Writes the topics.
class Exporter {
 public:
  Exporter(const recorder::Reader& recording, const std::filesystem::path& file)
      : world_(world_of(recording.header())),
        length_(recording.tick_length()),
        out_(file, "kilotwin"),
        scene_(add_channel<foxglove::SceneUpdate>(out_, "/scene")),
        robots_(add_channel<foxglove::PointCloud>(out_, "/robots")),
        poses_(add_channel<foxglove::PosesInFrame>(out_, "/poses")),
        counters_(add_channel<SwarmCounters>(out_, "/counters")),
        log_(add_channel<foxglove::Log>(out_, "/log")) {}

  void state(const proto::StateRecord& state) {
    const Time_ns time = time_of(state.tick());
    if (states_++ == 0) {
      first_ = state;
      write_arena(time);
    }
    if (!world_.movables.empty()) write_movables(state, time);
    write_robots(state, time);
    write_poses(state, time);
    write_counters(state, time);
  }

  void input(const proto::InputRecord& input) {
    write_log(time_of(input.tick()), foxglove::Log::INFO,
              fmt::format("input {}: {}", input.sequence_number(), proto::InputRecord::Kind_Name(input.kind())));
  }

  void end(const proto::EndRecord& end) {
    const bool failed = !end.failure().empty();
    write_log(time_of(end.tick()), failed ? foxglove::Log::ERROR : foxglove::Log::INFO,
              failed ? end.failure() : fmt::format("end of the run, state hash {:016x}", end.state_hash()));
  }

  std::uint64_t close() {
    out_.close();
    return states_;
  }

 private:
  [[nodiscard]] Time_ns time_of(std::int64_t tick) const {
    return static_cast<Time_ns>(std::llround(length_.seconds_at(Tick{tick}) * 1e9));
  }

  void write(std::uint16_t channel, Time_ns time, const google::protobuf::Message& message) {
    message.SerializeToString(&bytes_);
    out_.write(channel, time, bytes_);
  }

  void write_arena(Time_ns time) {
    foxglove::SceneUpdate scene;
    foxglove::SceneEntity* const arena = add_entity(scene, time, "arena");
    foxglove::LinePrimitive* const wall = arena->add_lines();
    wall->set_type(foxglove::LinePrimitive::LINE_LOOP);
    wall->mutable_pose()->mutable_orientation()->set_w(1);
    wall->set_thickness(5 * kMetres);
    set(wall->mutable_color(), kWall);
    for (const Point2 corner : edge_of(world_.arena)) add_point(wall->mutable_points(), corner);
    foxglove::SceneEntity* const obstacles = add_entity(scene, time, "obstacles");
    for (const ObstacleBody& body : world_.obstacles) {
      add_body(obstacles, body.shape, {body.place.x_mm, body.place.y_mm, body.heading_rad}, body.height_mm,
               kObstacle);
    }
    write(scene_, time, scene);
  }

  void write_movables(const proto::StateRecord& state, Time_ns time) {
    foxglove::SceneUpdate scene;
    foxglove::SceneEntity* const entity = add_entity(scene, time, "movables");
    for (int i = 0; i < state.movable_x_mm_size(); ++i) {
      const MovableBodyModel& body = world_.movables[static_cast<std::size_t>(i)];
      add_body(entity, body.shape, {state.movable_x_mm(i), state.movable_y_mm(i), state.movable_heading_rad(i)},
               body.height_mm, kMovable);
    }
    write(scene_, time, scene);
  }

  void write_robots(const proto::StateRecord& state, Time_ns time) {
    struct Point {
      float x, y, z;
      std::uint8_t red, green, blue, alpha;
    };
    foxglove::PointCloud cloud;
    set(cloud.mutable_timestamp(), time);
    cloud.set_frame_id(kFrame);
    cloud.mutable_pose()->mutable_orientation()->set_w(1);
    cloud.set_point_stride(sizeof(Point));
    std::uint32_t offset = 0;
    for (const char* name : {"x", "y", "z", "red", "green", "blue", "alpha"}) {
      foxglove::PackedElementField* const field = cloud.add_fields();
      const bool place = offset < 3 * sizeof(float);
      field->set_name(name);
      field->set_offset(offset);
      field->set_type(place ? foxglove::PackedElementField::FLOAT32 : foxglove::PackedElementField::UINT8);
      offset += place ? std::uint32_t{sizeof(float)} : 1u;
    }
    std::string& data = *cloud.mutable_data();
    data.resize(sizeof(Point) * static_cast<std::size_t>(state.x_mm_size()));
    for (int i = 0; i < state.x_mm_size(); ++i) {
      const auto led = static_cast<std::uint8_t>(state.led()[static_cast<std::size_t>(i)]);
      const auto part = [led](int shift) { return static_cast<std::uint8_t>(85 * (led >> shift & 3)); };
      constexpr std::uint8_t kDark = 150;
      Point point{static_cast<float>(state.x_mm(i) * kMetres),
                  static_cast<float>(state.y_mm(i) * kMetres),
                  0.0f,
                  part(0),
                  part(2),
                  part(4),
                  255};
      if (led == 0) point.red = point.green = point.blue = kDark;
      std::memcpy(data.data() + sizeof(Point) * static_cast<std::size_t>(i), &point, sizeof point);
    }
    write(robots_, time, cloud);
  }

  void write_poses(const proto::StateRecord& state, Time_ns time) {
    foxglove::PosesInFrame poses;
    set(poses.mutable_timestamp(), time);
    poses.set_frame_id(kFrame);
    for (int i = 0; i < state.x_mm_size(); ++i)
      set(poses.add_poses(), state.x_mm(i), state.y_mm(i), 0, state.heading_rad(i));
    write(poses_, time, poses);
  }

  void write_counters(const proto::StateRecord& state, Time_ns time) {
    SwarmCounters counters;
    set(counters.mutable_timestamp(), time);
    std::uint32_t running = 0, failed = 0;
    for (const char life : state.life_cycle()) {
      running += static_cast<std::uint8_t>(life) == static_cast<std::uint8_t>(LifeCycle::kRunning);
      failed += static_cast<std::uint8_t>(life) == static_cast<std::uint8_t>(LifeCycle::kFailed);
    }
    double x = 0, y = 0, square = 0;
    for (int i = 0; i < state.x_mm_size(); ++i) {
      const double dx = state.x_mm(i) - first_.x_mm(i), dy = state.y_mm(i) - first_.y_mm(i);
      x += state.x_mm(i);
      y += state.y_mm(i);
      square += dx * dx + dy * dy;
    }
    counters.set_robots_running(running);
    counters.set_robots_failed(failed);
    counters.set_mean_x_mm(x / state.x_mm_size());
    counters.set_mean_y_mm(y / state.x_mm_size());
    counters.set_mean_square_displacement_mm2(square / state.x_mm_size());
    write(counters_, time, counters);
  }

  void write_log(Time_ns time, foxglove::Log::Level level, const std::string& text) {
    foxglove::Log log;
    set(log.mutable_timestamp(), time);
    log.set_level(level);
    log.set_message(text);
    log.set_name("kilotwin");
    write(log_, time, log);
  }

  const World world_;
  const TickLength length_;
  McapWriter out_;
  const std::uint16_t scene_, robots_, poses_, counters_, log_;
  proto::StateRecord first_;
  std::uint64_t states_ = 0;
  std::string bytes_;  // reused
};

}  // namespace

std::uint64_t export_mcap(recorder::Reader& recording, const std::filesystem::path& file, double every_s) {
  if (!(every_s >= 0.001)) throw UserError(fmt::format("--every {}: expected a time of at least 0.001 s", every_s));
  const recorder::RecordingSchedule schedule(recording.tick_length(), every_s);
  Exporter exporter(recording, file);
  Tick due{0};
  while (const proto::Record* const record = recording.next()) {
    if (record->has_state() && Tick{record->state().tick()} >= due) {
      exporter.state(record->state());
      due = schedule.at_or_after(Tick{record->state().tick()} + 1);
    }
    if (record->has_input()) exporter.input(record->input());
    if (record->has_end()) exporter.end(record->end());
  }
  const std::uint64_t states = exporter.close();
  if (states == 0) throw UserError(fmt::format("{}: has no state", recording.path().string()));
  return states;
}

}  // namespace kilotwin::mcap
