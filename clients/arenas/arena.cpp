#include "clients/arenas/arena.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/state_hash.hpp"
#include "core/federation/frame_check.hpp"
#include "core/observations/variable_sampler.hpp"
#include "idl/manifest.pb.h"
#include "services/behaviours/host_memory.hpp"
#include "services/comm/firmware_robots.hpp"
#include "services/comm/radio_counters.hpp"

namespace kilotwin::arenas {
namespace {

/// Nobody records an arena.
class Nobody final : public RunObserver {
  void state(Tick, const SwarmView&, bool) override {}
  void hash(Tick, std::uint64_t) override {}
  void input(const Directive&) override {}
};

constexpr Tick kFirst{0};

}  // namespace

Arena::Arena(std::shared_ptr<const RunPlan> plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
             const std::filesystem::path& run_directory)
    : plan_(std::move(plan)),
      engines_(*plan_, programs, {run_directory, kFirst, 1, false}),
      schedule_(kFirst, plan_->last_tick, 0),
      station_outputs_(*plan_, {}, kFirst) {
  const proto::Manifest& manifest = plan_->manifest();
  for (const proto::ProgramVariable& variable : manifest.variable()) {
    auto& places = places_.emplace_back(static_cast<std::size_t>(manifest.program_size()));
    for (const proto::VariablePlace& place : variable.place())
      places.at(place.program()) = std::make_unique<const VariablePlace>(place);
  }
  engines_.begin();
  chain_ = hash_chain(chain_, engines_.hash_sum());
}

void Arena::step(std::int64_t ticks) {
  Nobody nobody;
  for (std::int64_t i = 0; i < ticks; ++i) {
    const Tick from = now();
    if (schedule_.verdict(from) != RunSchedule::Verdict::kStep) return;
    engines_.step(alone_, from, schedule_);
    chain_ = hash_chain(chain_, engines_.hash_sum());
    station_outputs_.take(from, engines_.station(), nobody);
  }
}

std::vector<behaviours::BehavioursEngine::Failure> Arena::failures() const {
  std::vector<behaviours::BehavioursEngine::Failure> failures;
  for (const auto& host : engines_.hosts())
    failures.insert(failures.end(), host->failures().begin(), host->failures().end());
  return failures;
}

void Arena::add(Directive directive) {
  directive.sequence_number = directives_++;
  directive.tick = now();
  schedule_.add(directive);
}

void Arena::send(const OverheadPacket& packet) {
  Directive directive;
  directive.kind = DirectiveKind::kOverheadInput;
  directive.packet = packet;
  add(directive);
}

void Arena::place(const Relocation& where) {
  Directive directive;
  directive.kind = DirectiveKind::kRelocation;
  directive.relocation = where;
  double& heading_rad = directive.relocation.pose.heading_rad;
  heading_rad = wrapped(std::remainder(heading_rad, 2 * kPi));
  if (const char* const why = defect(directive.relocation, *plan_))
    throw UserError(fmt::format("{} {} cannot be placed at {:g}, {:g}: {}",
                                where.movable ? "movable body" : "robot", where.body, where.pose.x_mm,
                                where.pose.y_mm, why));
  add(directive);
}

const VariablePlace* Arena::place_of(std::size_t index, std::uint32_t robot) const {
  const std::uint32_t program = plan_->program_of(robot);
  if (program == kNoProgram || plan_->firmware(robot)) return nullptr;
  return places_.at(index).at(program).get();
}

behaviours::BehavioursEngine& Arena::host_of(std::uint32_t robot) const {
  return *engines_.hosts()[plan_->host_of(robot).value()];
}

std::string Arena::name_of(std::size_t index) const {
  return plan_->manifest().variable(static_cast<int>(index)).name();
}

double Arena::variable(std::size_t index, std::uint32_t robot) const {
  if (name_of(index) == kBatteryVariable && !plan_->tracked(robot)) {
    if (!plan_->firmware(robot)) return host_of(robot).battery_V(robot);
    const comm::FirmwareRobots& robots = *engines_.radio().firmware();
    return robots.battery_V(comm::index_of(robot, robots));
  }
  const VariablePlace* const place = place_of(index, robot);
  const comm::RadioCounter* const counter = comm::radio_counter(name_of(index));
  if (place == nullptr && counter != nullptr && plan_->program_of(robot) != kNoProgram)
    return engines_.radio().radio_counts()[robot].*counter->count;
  if (place == nullptr) return std::numeric_limits<double>::quiet_NaN();
  const std::optional<std::uint64_t> raw = place->fetch(robot, behaviours::HostMemory(host_of(robot)));
  return raw ? place->number(*raw) : std::numeric_limits<double>::quiet_NaN();
}

Arena::Write Arena::writing(std::size_t index, std::uint32_t robot, double value) const {
  const VariablePlace* const place = place_of(index, robot);
  const behaviours::HostMemory memory(host_of(robot));
  const auto address = place == nullptr ? std::nullopt : place->address(robot, memory);
  const auto before = place == nullptr ? std::nullopt : place->fetch(robot, memory);
  if (!address || !before)
    throw UserError(fmt::format("robot {} has no variable {} that can be set", robot, name_of(index)));
  const std::optional<std::uint64_t> after = place->with(value, *before);
  if (!after) throw UserError(fmt::format("robot {}: {} cannot hold {:g}", robot, name_of(index), value));
  Write write{robot, *address, place->octets(), {}};
  for (std::size_t i = 0; i < write.octets; ++i) write.content.at(i) = static_cast<std::uint8_t>(*after >> 8 * i);
  return write;
}

void Arena::write(const Write& write) {
  KILOTWIN_DEMAND(
      host_of(write.robot).write(write.robot, write.address, std::span(write.content).first(write.octets)));
}

}  // namespace kilotwin::arenas
