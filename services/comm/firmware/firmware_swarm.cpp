#include "services/comm/firmware/firmware_swarm.hpp"

#include <algorithm>
#include <cstring>
#include <map>

#include "core/base/error.hpp"
#include "core/base/spin_up.hpp"
#include "core/base/state_hash.hpp"
#include "core/os/files.hpp"
#include "core/os/worker_pool.hpp"
#include "services/comm/firmware/eeprom.hpp"
#include "services/comm/tick_timers.hpp"

namespace kilotwin::firmware {
namespace {

namespace fs = std::filesystem;

/// Own cycles of a robot between two of its regular timer interrupts.
constexpr comm::Cycles kPeriod = comm::kTimerCounts * comm::kTimerCount;

FlashImage read_program(const Program& program, const fs::path& run_directory) {
  const fs::path path = run_directory / "programs" / program.file();
  const auto octets = os::read_if_there(path);
  if (!octets) {
    throw UserError(path.string() + ": cannot be read; the run directory must hold the programs of its manifest");
  }
  return parse_firmware(*octets, path.string());
}

}  // namespace

FirmwareSwarm::FirmwareSwarm(const RunPlan& plan, const fs::path& run_directory, std::uint32_t threads, Tick first,
                             bool keeps_logs)
    : cycles_per_tick_(plan.tick_length.cycles()),
      senses_(plan, {0, plan.robots()}),
      workers_(std::make_unique<os::WorkerPool>(threads)) {
  std::map<std::uint32_t, FlashImage> images;
  const comm::TickTimers timers(plan);
  const Random random(plan.seed());
  const RobotParameters parameters(plan);
  const RadioParameters radios(plan);
  for (std::uint32_t id = 0; id < plan.robots(); ++id) {
    if (!plan.firmware(id)) continue;
    const std::uint32_t program = plan.program_of(id);
    if (images.count(program) == 0) images.emplace(program, read_program(plan.programs()[program], run_directory));
    ids_.push_back(id);
    Robot& robot = robots_.emplace_back();
    robot.period = timers.period(id);
    robot.switched_on = timers.next(id) - robot.period;
    std::array<std::uint8_t, kEepromOctets> eeprom =
        make_eeprom(plan.uid_of(id), parameters.calibration(id), radios.table(id));
    const auto brought = std::find_if(plan.eeproms().begin(), plan.eeproms().end(),
                                      [id](const RobotEeprom& stated) { return stated.robot == id; });
    if (brought != plan.eeproms().end()) std::copy_n(brought->content.begin(), eeprom.size(), eeprom.begin());
    robot.mcu = std::make_unique<Mcu>(images.at(program), eeprom, random, id);
  }
  // Up to tick 0, before which nobody sends.
  std::vector<std::vector<comm::Cycles>> flashes(robots_.size());
  workers_->for_each(robots_.size(), [&](std::size_t i) { run_robot(robots_[i], 0, {}, flashes[i]); });
  if (keeps_logs)
    logs_.emplace(run_directory, plan.tick_length, first,
                  [&plan](std::uint32_t robot) { return plan.firmware(robot); });
  // The text that they print while they are switched on belongs to the run's beginning.
  if (first > Tick{0}) {
    for (Robot& robot : robots_) robot.mcu->printed().clear();
  }
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
  until_ = until;
  workers_->for_each(robots.size(), [&](std::size_t n) {
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
  flashes.clear();
  auto next = robot.light.cbegin();
  std::size_t pulse = 0;
  for (comm::Cycles begin = begin_;;) {
    const comm::Cycles end = std::min(begin + kSpan, until);
    const auto first = next;
    for (; pulse < light.size() && light[pulse].time < end; ++pulse) ++next;
    mcu.run(own(robot, end), {first, next});
    // An instruction may end a little later than the span.
    for (std::size_t n = flashes.size(); n < mcu.flashes().size(); ++n)
      flashes.push_back(std::min(nominal(robot, mcu.flashes()[n]), end - 1));
    begin = end;
    if (begin >= until) break;
  }
  mcu.clear_flashes();
}

void FirmwareSwarm::commit() {
  for (std::uint32_t i = 0; i < robots_.size(); ++i) {
    Robot& robot = robots_[i];
    robot.has_run = false;
    write_log(i);
  }
  begin_ = until_;
}

void FirmwareSwarm::begin_tick(const SwarmView& swarm) {
  begin_ = swarm.tick.count() * cycles_per_tick_;
  senses_.at(swarm);
  for (std::uint32_t i = 0; i < robots_.size(); ++i) {
    Robot& robot = robots_[i];
    robot.has_sent = false;
    robot.mcu->set_readings(senses_.readings(ids_[i]));
  }
}

void FirmwareSwarm::end_tick() {
  for (Robot& robot : robots_) {
    const Mcu::MotorUse use = robot.mcu->take_motors();
    robot.shown_left = use.left;
    robot.shown_right = use.right;
    if (use.phases.count != 0) {
      const MotorShare::Pair shown = robot.motor_share.choose(use.phases);
      robot.shown_left = shown.left;
      robot.shown_right = shown.right;
    }
    const auto full_cycles = static_cast<std::int64_t>(use.full_cycles);
    robot.spin_up = full_cycles > 0 ? spin_up_of(full_cycles, cycles_per_tick_) : std::uint8_t{0};
  }
  if (!senses_.has_batteries()) return;
  for (std::uint32_t i = 0; i < robots_.size(); ++i) use_battery(i);
}

void FirmwareSwarm::use_battery(std::uint32_t i) {
  Robot& robot = robots_[i];
  const std::uint32_t id = ids_[i];
  if (robot.flat) {
    senses_.rest(id);
    if (!senses_.can_restart(id)) return;
    robot.flat = false;
    robot.mcu->power_on();
    return;
  }
  const firmware::Outputs out = robot.mcu->outputs();
  senses_.spend(id, {robot.shown_left, robot.shown_right, out.led, !robot.mcu->listening(), robot.has_sent});
  if (!senses_.is_flat(id)) return;
  robot.mcu->power_off();
  robot.flat = true;
  robot.shown_left = robot.shown_right = robot.spin_up = 0;
}

/// Writes the text that the robot has printed since the last commit.
void FirmwareSwarm::write_log(std::uint32_t i) {
  std::string& printed = robots_[i].mcu->printed();
  if (printed.empty()) return;
  if (logs_) logs_->write(Tick{begin_ / cycles_per_tick_}, ids_[i], printed);
  printed.clear();
}

comm::FirmwareRobots::Outputs FirmwareSwarm::outputs(std::uint32_t i) const {
  const Mcu& mcu = *robots_[i].mcu;
  const firmware::Outputs shown = mcu.outputs();
  Outputs out;
  out.motor_left = robots_[i].shown_left;
  out.motor_right = robots_[i].shown_right;
  out.led = shown.led;
  out.spin_up = robots_[i].spin_up;
  out.listening = mcu.listening();
  out.flat = robots_[i].flat;
  if (mcu.halt() == Halt::kIllegalInstruction || mcu.halt() == Halt::kBadAddress) {
    out.fault = static_cast<std::uint8_t>(mcu.halt());
    out.fault_at = mcu.program_counter();
  }
  return out;
}

bool FirmwareSwarm::read(std::uint32_t i, std::uint16_t address, std::span<std::uint8_t> to) const {
  constexpr std::size_t kRam = 0x100, kRamEnd = 0x900;
  if (i >= robots_.size() || robots_[i].flat || address < kRam || address + to.size() > kRamEnd) return false;
  for (std::size_t k = 0; k < to.size(); ++k)
    to[k] = robots_[i].mcu->memory(static_cast<std::uint16_t>(address + k));
  return true;
}

std::uint64_t FirmwareSwarm::word(std::uint32_t i) const {
  const Mcu& mcu = *robots_[i].mcu;
  const std::uint64_t word = hash_mix(mcu.now(), mcu.program_counter());
  return senses_.has_batteries() ? hash_mix(word, static_cast<std::uint64_t>(senses_.charge(ids_[i]))) : word;
}

void FirmwareSwarm::flush_logs() const {
  if (logs_) logs_->flush();
}

std::string FirmwareSwarm::save(std::uint32_t i) const {
  flush_logs();  // a run that resumes from this checkpoint keeps the lines printed before it
  const Robot& robot = robots_[i];
  std::string board{robot.flat ? '\1' : '\0', static_cast<char>(robot.shown_left),
                    static_cast<char>(robot.shown_right), static_cast<char>(robot.spin_up)};
  board.append(reinterpret_cast<const char*>(&robot.motor_share), sizeof(MotorShare));
  std::int64_t battery[2] = {0, 0};
  if (senses_.has_batteries()) battery[0] = senses_.charge(ids_[i]), battery[1] = senses_.drain(ids_[i]);
  for (const std::int64_t value : battery) {
    for (int shift = 0; shift < 64; shift += 8) board.push_back(static_cast<char>(value >> shift));
  }
  return board + robot.mcu->save();
}

void FirmwareSwarm::load(std::uint32_t i, const std::string& octets) {
  constexpr std::size_t kBattery = 4 + sizeof(MotorShare), kBoard = kBattery + 2 * sizeof(std::int64_t);
  if (octets.size() < kBoard)
    throw RunError("a firmware robot is missing in the checkpoint; resume from another one");
  Robot& robot = robots_[i];
  robot.flat = octets[0] != 0;
  robot.shown_left = static_cast<std::uint8_t>(octets[1]);
  robot.shown_right = static_cast<std::uint8_t>(octets[2]);
  robot.spin_up = static_cast<std::uint8_t>(octets[3]);
  std::memcpy(&robot.motor_share, octets.data() + 4, sizeof(MotorShare));
  std::uint64_t battery[2] = {0, 0};
  for (std::size_t n = kBattery; n < kBoard; ++n)
    battery[(n - kBattery) / 8] |= std::uint64_t{static_cast<std::uint8_t>(octets[n])} << (n - kBattery) % 8 * 8;
  if (senses_.has_batteries())
    senses_.restore(ids_[i], static_cast<std::int64_t>(battery[0]), static_cast<std::int64_t>(battery[1]));
  robot.mcu->load(octets.substr(kBoard));
}

std::unique_ptr<comm::FirmwareRobots> make_firmware_robots(const RunPlan& plan, const fs::path& run_directory,
                                                           std::uint32_t threads, Tick first, bool keeps_logs) {
  if (!plan.has_firmware()) return nullptr;
  return std::make_unique<FirmwareSwarm>(plan, run_directory, threads, first, keeps_logs);
}

}  // namespace kilotwin::firmware
