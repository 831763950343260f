#include "tests/clients/monitor/virtual_arena.hpp"

#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>

#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "core/observations/events.hpp"
#include "idl/recording.pb.h"
#include "services/ark/ark_message.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin::monitor::testing {
namespace {

constexpr double kNearWall_mm = 100;

/// CPU time of this thread.
double cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

std::string arena_text(const ArenaOptions& options) {
  const std::string side = std::to_string(options.side_mm);
  return "seed: " + std::to_string(options.seed) + " arena { width_mm: " + side + " height_mm: " + side + " } " +
         options.model;
}

std::vector<kilotwin::testing::ScenePose> crowd(const ArenaOptions& options) {
  return kilotwin::testing::random_crowd(options.robots, options.side_mm - 4 * kNearWall_mm,
                                         options.side_mm - 4 * kNearWall_mm, 45, options.seed);
}

RunPlan watched_plan(const ArenaOptions& options, bool shadow) {
  return kilotwin::testing::make_plan(arena_text(options) + options.tracker +
                                          " robots { count: " + std::to_string(options.robots) + " body: TRACKED" +
                                          (shadow ? " says { shadow: true } }" : " }"),
                                      crowd(options));
}

RunPlan real_plan(const ArenaOptions& options) {
  return kilotwin::testing::make_plan(
      arena_text(options) + options.faults + " robots { count: " + std::to_string(options.robots) + " }",
      crowd(options));
}

}  // namespace

VirtualArena::VirtualArena(const ArenaOptions& options, const MonitorSettings& settings)
    : options_(options),
      plan_(watched_plan(options, settings.station_commands.empty())),
      reality_(real_plan(options)),
      drive_(reality_),
      parameters_(reality_),
      monitor_(plan_, settings, {}),
      swarm_(plan_.robots(), 0, plan_.memory.size()),
      random_(options.seed),
      x_mm_(options.robots),
      y_mm_(options.robots),
      heading_rad_(options.robots),
      ids_(options.robots),
      tracked_(options.robots, 0),
      duties_(options.robots),
      command_(options.robots, MotionCommand::kStop),
      station_commands_(settings.station_commands),
      until_(options.robots, 0) {
  std::iota(ids_.begin(), ids_.end(), 0u);
  for (std::uint32_t robot = 0; robot < options.robots; ++robot) {
    const Pose pose = reality_.initial_pose(robot);
    x_mm_[robot] = pose.x_mm;
    y_mm_[robot] = pose.y_mm;
    heading_rad_[robot] = pose.heading_rad;
    swarm_.life_cycle[robot] = static_cast<std::uint8_t>(LifeCycle::kRunning);
  }
  swarm_.tick = Tick{0};
}

void VirtualArena::choose_commands() {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double limit = options_.side_mm / 2 - kNearWall_mm;
  for (std::uint32_t robot = 0; robot < options_.robots; ++robot) {
    const double outward =
        std::abs(x_mm_[robot]) > limit || std::abs(y_mm_[robot]) > limit
            ? x_mm_[robot] * std::cos(heading_rad_[robot]) + y_mm_[robot] * std::sin(heading_rad_[robot])
            : -1;
    MotionCommand& command = command_[robot];
    const MotionCommand last = command;
    if (outward > 0) {
      if (!is_turn(command)) command = MotionCommand::kTurnLeft;
      until_[robot] = swarm_.tick.count() + 30;
    } else if (swarm_.tick.count() >= until_[robot]) {
      const double draw = uniform(random_);
      command = draw < 0.55      ? MotionCommand::kStraight
                : draw < 0.75    ? MotionCommand::kTurnLeft
                : draw < 0.95    ? MotionCommand::kTurnRight
                : options_.rests ? MotionCommand::kStop
                                 : MotionCommand::kStraight;
      until_[robot] =
          swarm_.tick.count() + static_cast<std::int64_t>(30 + (is_turn(command) ? 60 : 300) * uniform(random_));
    }
    duties_[robot] = duties_of(command, parameters_.calibration(robot));
    if (!station_commands_.empty()) {
      if (command != last) tell_monitor(robot, command);
      continue;
    }
    swarm_.motor_left[robot] = duties_[robot].left;
    swarm_.motor_right[robot] = duties_[robot].right;
  }
}

/// As the station's packet is recorded.
void VirtualArena::tell_monitor(std::uint32_t robot, MotionCommand command) {
  OverheadFrame frame;
  frame.tick = swarm_.tick;
  for (const auto& [type, meaning] : station_commands_) {
    if (meaning != command) continue;
    const std::array<ark::ArkMessage, 1> message{{{static_cast<std::uint16_t>(robot), type, 77}}};
    frame.packets.push_back({OverheadCommand::kRepeat, ark::pack(message)});
  }
  proto::Observations observed;
  note_packets(frame, observed);
  for (const proto::EventRecord& event : observed.event()) monitor_.take(event);
}

void VirtualArena::move() {
  drives_.reserve(options_.robots);
  drives_.count = 0;
  for (std::uint32_t robot = 0; robot < options_.robots; ++robot)
    drive_.add(drives_, robot, robot, swarm_.tick, duties_[robot], heading_rad_[robot], 1);
  if (!drive_.effects().empty()) {
    const RobotColumns known{ids_, x_mm_, y_mm_, heading_rad_, memory_, duties_, tracked_};
    drive_.change(drives_, swarm_.tick, known, nullptr);
  }
  drive_.integrate(drives_);
  for (std::uint32_t robot = 0; robot < options_.robots; ++robot) {
    x_mm_[robot] += drives_.x_mm[robot];
    y_mm_[robot] += drives_.y_mm[robot];
    heading_rad_[robot] = wrapped(heading_rad_[robot] + drives_.turn_rad[robot]);
  }
}

TrackerSample VirtualArena::picture(std::array<double, 3> knock) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  TrackerSample sample;
  sample.frame = ++frame_;
  sample.capture_cycle = swarm_.tick.count() * plan_.tick_length.cycles();
  const auto position_variance = static_cast<float>(options_.position_sd_mm * options_.position_sd_mm);
  const auto heading_variance = options_.tells_headings
                                    ? static_cast<float>(options_.heading_sd_rad * options_.heading_sd_rad)
                                    : std::numeric_limits<float>::infinity();
  const double c = std::cos(knock[2]), s = std::sin(knock[2]);
  for (std::uint32_t robot = 0; robot < options_.robots; ++robot) {
    if (uniform(random_) < options_.drops) continue;
    sample.robot.push_back(robot);
    sample.state.push_back(static_cast<std::uint8_t>(TrackedState::kSeen));
    const double x = c * x_mm_[robot] - s * y_mm_[robot] + knock[0],
                 y = s * x_mm_[robot] + c * y_mm_[robot] + knock[1];
    sample.x.push_back(static_cast<float>(x + options_.position_sd_mm * normal(random_)));
    sample.y.push_back(static_cast<float>(y + options_.position_sd_mm * normal(random_)));
    sample.heading_rad.push_back(
        static_cast<float>(wrapped(heading_rad_[robot] + knock[2] + options_.heading_sd_rad * normal(random_))));
    sample.xx.push_back(position_variance);
    sample.xy.push_back(0);
    sample.yy.push_back(position_variance);
    sample.heading_variance_rad2.push_back(heading_variance);
    sample.led.push_back(kUnknownLed);
  }
  return sample;
}

void VirtualArena::step(std::array<double, 3> knock) {
  choose_commands();
  const TrackerSample sample = picture(knock);
  for (std::size_t n = 0; n < sample.robot.size(); ++n) {
    const std::uint32_t robot = sample.robot[n];
    swarm_.x_mm[robot] = sample.x[n];
    swarm_.y_mm[robot] = sample.y[n];
    swarm_.heading_rad[robot] = sample.heading_rad[n];
  }
  const double begun_ns = cpu_ns();
  monitor_.take(sample);
  monitor_.advance(swarm_);
  monitor_ns_ += cpu_ns() - begun_ns;
  move();
  ++swarm_.tick;
}

void VirtualArena::carry(std::uint32_t robot, double dx_mm, double dy_mm) {
  x_mm_[robot] += dx_mm;
  y_mm_[robot] += dy_mm;
}

}  // namespace kilotwin::monitor::testing
