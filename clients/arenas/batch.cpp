#include "clients/arenas/batch.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/base/error.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::arenas {
namespace {

/// Indices of the arrays that layout_of() lists.
enum Array : std::size_t {
  kTick,
  kEnded,
  kStateHash,
  kRobotsFailed,
  kSent,
  kReceived,
  kX,
  kY,
  kHeading,
  kLed,
  kMotors,
  kLifeCycle,
  kBodyX,
  kBodyY,
  kBodyHeading,
  kVariables,
  kWanted
};

std::vector<ArrayLayout> layout_of(std::size_t arenas, const RunPlan& plan) {
  const std::size_t robots = plan.robots(), bodies = plan.movables();
  const auto variables = static_cast<std::size_t>(plan.manifest().variable_size());
  return {{"tick", "i8", {arenas}},
          {"ended", "u1", {arenas}},
          {"state_hash", "u8", {arenas}},
          {"robots_failed", "u4", {arenas}},
          {"sent", "u8", {arenas}},
          {"received", "u8", {arenas}},
          {"x_mm", "f8", {arenas, robots}},
          {"y_mm", "f8", {arenas, robots}},
          {"heading_rad", "f8", {arenas, robots}},
          {"led", "u1", {arenas, robots, 3}},
          {"motors", "u1", {arenas, robots, 2}},
          {"life_cycle", "u1", {arenas, robots}},
          {"body_x_mm", "f8", {arenas, bodies}},
          {"body_y_mm", "f8", {arenas, bodies}},
          {"body_heading_rad", "f8", {arenas, bodies}},
          {"variables", "f8", {variables, arenas, robots}},
          {"wanted", "f8", {arenas, robots}}};
}

}  // namespace

Batch::Batch(PlanOf plan_of, std::filesystem::path run_directory, std::span<const std::uint64_t> seeds,
             std::uint32_t threads)
    : plan_of_(std::move(plan_of)),
      run_directory_(std::move(run_directory)),
      arenas_(begun(seeds)),
      arrays_(layout_of(arenas_.size(), plan())),
      workers_(threads) {
  for (std::uint32_t i = 0; i < count(); ++i) show(i);
  watch();
}

std::unique_ptr<Arena> Batch::begun(std::uint64_t seed) {
  std::shared_ptr<const RunPlan> plan = plan_of_(seed);
  if (!programs_) programs_ = behaviours::ProgramSet::load(*plan, run_directory_);
  return std::make_unique<Arena>(std::move(plan), programs_, run_directory_);
}

Batch::Arenas Batch::begun(std::span<const std::uint64_t> seeds) {
  Arenas arenas;
  for (const std::uint64_t seed : seeds) arenas.push_back(begun(seed));
  return arenas;
}

std::vector<std::string> Batch::variables() const {
  std::vector<std::string> names;
  for (const proto::ProgramVariable& variable : plan().manifest().variable()) names.push_back(variable.name());
  return names;
}

void Batch::step(std::int64_t ticks) {
  workers_.for_each(arenas_.size(), [&](std::size_t i) {
    arenas_[i]->step(ticks);
    show(static_cast<std::uint32_t>(i));
  });
}

void Batch::reset(std::span<const std::pair<std::uint32_t, std::uint64_t>> seeds) {
  watchdog_.reset();
  for (const auto& [arena, seed] : seeds) {
    arenas_.at(arena) = begun(seed);
    show(arena);
  }
  watch();
}

void Batch::send(std::span<const std::uint32_t> arenas, const OverheadPacket& packet) {
  for (const std::uint32_t arena : arenas) arenas_.at(arena)->send(packet);
}

void Batch::place(std::span<const std::uint32_t> arenas, const Relocation& where) {
  // All have the same arena and bodies, so what the first takes all take.
  for (const std::uint32_t arena : arenas) arenas_.at(arena)->place(where);
}

void Batch::set_variable(std::size_t index) {
  const std::uint32_t robots = plan().robots();
  const std::span<const double> wanted = arrays_.array<const double>(kWanted);
  std::vector<std::vector<Arena::Write>> writes(count());
  for (std::uint32_t i = 0; i < count(); ++i) {
    for (std::uint32_t robot = 0; robot < robots; ++robot) {
      const double value = wanted[std::size_t{i} * robots + robot];
      if (std::isnan(value)) continue;
      try {
        writes[i].push_back(arenas_[i]->writing(index, robot, value));
      } catch (const UserError& error) {
        throw UserError(fmt::format("arena {}, {}", i, error.what()));
      }
    }
  }
  for (std::uint32_t i = 0; i < count(); ++i) {
    for (const Arena::Write& write : writes[i]) arenas_[i]->write(write);
    show(i);
  }
}

/// Writes what arena `index` shows into the arrays.
void Batch::show(std::uint32_t index) const {
  const Arena& arena = *arenas_[index];
  const SwarmView& swarm = arena.swarm();
  const std::size_t robots = arena.plan().robots(), bodies = arena.plan().movables();
  arrays_.array<std::int64_t>(kTick)[index] = arena.now().count();
  arrays_.array<std::uint8_t>(kEnded)[index] = arena.ended() ? 1 : 0;
  arrays_.array<std::uint64_t>(kStateHash)[index] = arena.state_hash();
  arrays_.array<std::uint32_t>(kRobotsFailed)[index] = arena.robots_failed();
  arrays_.array<std::uint64_t>(kSent)[index] = arena.radio().counters().sent;
  arrays_.array<std::uint64_t>(kReceived)[index] = arena.radio().counters().received;
  const auto copy = [&](Array array, const std::vector<double>& from, std::size_t count) {
    std::copy(from.begin(), from.end(), arrays_.array<double>(array).subspan(index * count, count).begin());
  };
  copy(kX, swarm.x_mm, robots);
  copy(kY, swarm.y_mm, robots);
  copy(kHeading, swarm.heading_rad, robots);
  copy(kBodyX, swarm.movable_x_mm, bodies);
  copy(kBodyY, swarm.movable_y_mm, bodies);
  copy(kBodyHeading, swarm.movable_heading_rad, bodies);
  const auto led = arrays_.array<std::uint8_t>(kLed).subspan(index * robots * 3);
  const auto motors = arrays_.array<std::uint8_t>(kMotors).subspan(index * robots * 2);
  const auto life_cycle = arrays_.array<std::uint8_t>(kLifeCycle).subspan(index * robots);
  for (std::size_t robot = 0; robot < robots; ++robot) {
    for (std::size_t channel = 0; channel < 3; ++channel)
      led[3 * robot + channel] = swarm.led[robot] >> 2 * channel & 3;
    motors[2 * robot] = swarm.motor_left[robot];
    motors[2 * robot + 1] = swarm.motor_right[robot];
    life_cycle[robot] = swarm.life_cycle[robot];
  }
  const auto variables = arrays_.array<double>(kVariables);
  for (std::size_t v = 0; v < arena.variables(); ++v) {
    const auto of_arena = variables.subspan((v * arenas_.size() + index) * robots, robots);
    for (std::uint32_t robot = 0; robot < robots; ++robot) of_arena[robot] = arena.variable(v, robot);
  }
}

void Batch::watch() {
  std::vector<const behaviours::BehavioursEngine*> engines;
  for (const auto& arena : arenas_) {
    for (const auto& host : arena->hosts()) engines.push_back(host.get());
  }
  watchdog_ = std::make_unique<behaviours::Watchdog>(std::move(engines));
}

}  // namespace kilotwin::arenas
