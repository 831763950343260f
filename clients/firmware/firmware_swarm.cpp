#include "clients/firmware/firmware_swarm.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <map>

#include "clients/firmware/crew.hpp"
#include "clients/firmware/eeprom.hpp"
#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "services/comm/tick_timers.hpp"

namespace kilotwin::firmware {
namespace {

namespace fs = std::filesystem;

/// Own cycles of a robot between two of its regular timer interrupts.
constexpr comm::Cycles kPeriod = comm::kTimerCounts * comm::kTimerCount;

FlashImage read_program(const proto::Program& program, const fs::path& run_directory) {
  const fs::path path = run_directory / "programs" / program_file(program);
  std::ifstream stream(path, std::ios::binary);
  const std::string octets{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    throw UserError(path.string() + ": cannot be read; the run directory must hold the programs of its manifest");
  }
  return parse_firmware(octets, path.string());
}

}  // namespace

FirmwareSwarm::FirmwareSwarm(const RunPlan& plan, const fs::path& run_directory, std::uint32_t threads,
                             bool keeps_logs)
    : logs_(keeps_logs ? run_directory / "logs" : fs::path{}),
      appends_logs_(plan.manifest.resumed()),
      crew_(std::make_unique<Crew>(threads)) {
  std::map<std::uint32_t, FlashImage> images;
  const comm::TickTimers timers(plan);
  const Random random(plan.seed());
  const RobotParameters parameters(plan);
  const RadioParameters radios(plan);
  for (std::uint32_t id = 0; id < plan.robots(); ++id) {
    if (!plan.firmware(id)) continue;
    const std::uint32_t program = plan.program_of(id);
    if (images.count(program) == 0)
      images.emplace(program, read_program(plan.manifest.program(static_cast<int>(program)), run_directory));
    ids_.push_back(id);
    Robot& robot = robots_.emplace_back();
    robot.period = timers.period(id);
    robot.switched_on = timers.next(id) - robot.period;
    robot.mcu = std::make_unique<Mcu>(images.at(program),
                                      make_eeprom(id, parameters.calibration(id), radios.table(id)), random, id);
  }
  // Up to tick 0, before which nobody sends.
  std::vector<std::vector<comm::Cycles>> flashes(robots_.size());
  crew_->share(static_cast<std::uint32_t>(robots_.size()),
               [&](std::uint32_t i) { run_robot(robots_[i], 0, {}, flashes[i]); });
  commit();
}

FirmwareSwarm::~FirmwareSwarm() = default;

/// The first own cycle at or after an instant.
OwnCycles FirmwareSwarm::own(const Robot& robot, comm::Cycles t) const {
  return static_cast<OwnCycles>(((t - robot.switched_on) * kPeriod + robot.period - 1) / robot.period);
}

comm::Cycles FirmwareSwarm::nominal(const Robot& robot, OwnCycles cycle) const {
  return robot.switched_on + static_cast<comm::Cycles>(cycle) * robot.period / kPeriod;
}

void FirmwareSwarm::run(comm::Cycles until, std::span<const std::uint32_t> robots,
                        const std::vector<std::vector<comm::Pulse>>& light,
                        std::vector<std::vector<comm::Cycles>>& flashes) {
  crew_->share(static_cast<std::uint32_t>(robots.size()), [&](std::uint32_t n) {
    const std::uint32_t i = robots[n];
    run_robot(robots_[i], until, light[i], flashes[i]);
  });
}

void FirmwareSwarm::run_robot(Robot& robot, comm::Cycles until, const std::vector<comm::Pulse>& light,
                              std::vector<comm::Cycles>& flashes) {
  Mcu& mcu = *robot.mcu;
  if (robot.has_run) {
    mcu.rewind();
    mcu.printed().clear();
  } else {
    mcu.mark();
  }
  robot.has_run = true;
  robot.light.clear();
  for (const comm::Pulse& pulse : light)
    robot.light.push_back({own(robot, pulse.time), pulse.gains.high, pulse.gains.low});
  mcu.run(own(robot, until), robot.light);
  flashes.clear();
  for (const OwnCycles flash : mcu.flashes()) flashes.push_back(std::min(nominal(robot, flash), until - 1));
  mcu.clear_flashes();
}

void FirmwareSwarm::commit() {
  for (std::uint32_t i = 0; i < robots_.size(); ++i) {
    Robot& robot = robots_[i];
    robot.has_run = false;
    const firmware::Outputs out = robot.mcu->outputs();
    robot.full = out.motor_left == 255 && out.motor_right == 255;
    robot.full_throughout = robot.full_throughout && robot.full;
    robot.kicked = robot.kicked || robot.full;
    if (!robot.mcu->printed().empty()) write_log(i);
  }
}

void FirmwareSwarm::begin_tick() {
  for (Robot& robot : robots_) {
    robot.full_throughout = robot.full;
    robot.kicked = robot.kick_goes_on;
  }
}

void FirmwareSwarm::end_tick() {
  for (Robot& robot : robots_) {
    robot.kick_goes_on = robot.full && !robot.full_throughout;
    robot.spun_up = robot.kicked && !robot.kick_goes_on && !robot.full_throughout;
    if (robot.kick_goes_on) continue;
    const firmware::Outputs out = robot.mcu->outputs();
    robot.shown_left = out.motor_left;
    robot.shown_right = out.motor_right;
  }
}

void FirmwareSwarm::write_log(std::uint32_t i) {
  Robot& robot = robots_[i];
  if (!logs_.empty()) {
    std::error_code ignored;
    fs::create_directories(logs_, ignored);
    const auto mode = appends_logs_ || robot.has_printed ? std::ios::app : std::ios::trunc;
    std::ofstream(logs_ / fmt::format("robot-{:05}.txt", ids_[i]), std::ios::out | mode) << robot.mcu->printed();
  }
  robot.has_printed = true;
  robot.mcu->printed().clear();
}

comm::FirmwareRobots::Outputs FirmwareSwarm::outputs(std::uint32_t i) const {
  const Mcu& mcu = *robots_[i].mcu;
  const firmware::Outputs shown = mcu.outputs();
  Outputs out;
  out.motor_left = robots_[i].shown_left;
  out.motor_right = robots_[i].shown_right;
  out.led = shown.led;
  out.spun_up = robots_[i].spun_up;
  out.listening = mcu.listening();
  if (mcu.halt() == Halt::kIllegalInstruction || mcu.halt() == Halt::kBadAddress) {
    out.fault = static_cast<std::uint8_t>(mcu.halt());
    out.fault_at = mcu.program_counter();
  }
  return out;
}

std::uint64_t FirmwareSwarm::word(std::uint32_t i) const {
  const Mcu& mcu = *robots_[i].mcu;
  return hash_mix(mcu.now(), mcu.program_counter());
}

std::string FirmwareSwarm::save(std::uint32_t i) const {
  const Robot& robot = robots_[i];
  const int flags = (robot.full ? 1 : 0) | (robot.kick_goes_on ? 2 : 0) | (robot.spun_up ? 4 : 0);
  const std::string board{static_cast<char>(flags), static_cast<char>(robot.shown_left),
                          static_cast<char>(robot.shown_right)};
  return board + robot.mcu->save();
}

void FirmwareSwarm::load(std::uint32_t i, const std::string& octets) {
  if (octets.size() < 3) throw RunError("a firmware robot is missing in the checkpoint; resume from another one");
  Robot& robot = robots_[i];
  robot.full = (octets[0] & 1) != 0;
  robot.kick_goes_on = (octets[0] & 2) != 0;
  robot.spun_up = (octets[0] & 4) != 0;
  robot.shown_left = static_cast<std::uint8_t>(octets[1]);
  robot.shown_right = static_cast<std::uint8_t>(octets[2]);
  robot.mcu->load(octets.substr(3));
}

std::unique_ptr<comm::FirmwareRobots> make_firmware_robots(const RunPlan& plan, const fs::path& run_directory,
                                                           std::uint32_t threads, bool keeps_logs) {
  if (!plan.has_firmware()) return nullptr;
  return std::make_unique<FirmwareSwarm>(plan, run_directory, threads, keeps_logs);
}

}  // namespace kilotwin::firmware
