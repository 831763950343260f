#include "clients/local/engines.hpp"

#include <chrono>

#include "core/os/worker_pool.hpp"
#include "services/comm/firmware/firmware_swarm.hpp"

namespace kilotwin::local {

Engines::Engines(const RunPlan& plan, const std::shared_ptr<behaviours::ProgramSet>& programs,
                 const Options& options)
    : plan_(plan),
      first_(options.first),
      radio_(plan, firmware::make_firmware_robots(plan, options.run_directory, options.firmware_threads,
                                                  options.first, options.keeps_firmware_logs)),
      station_(plan, options.run_directory),
      swarm_(plan.robots(), plan.movables(), plan.memory.size()),
      task_ns_(plan.federates()),
      hash_parts_(plan.federates()) {
  for (std::uint32_t p = 0; p < plan.grid.size(); ++p)
    physics_.push_back(physics::make_engine(plan, PartitionId{p}));
  for (std::uint32_t h = 0; h < plan.hosts; ++h)
    hosts_.push_back(std::make_unique<behaviours::BehavioursEngine>(plan, HostId{h}, programs));
  for (Frames& frames : frames_) connect(frames);
}

void Engines::connect(Frames& frames) const {
  const std::size_t partitions = physics_.size();
  frames.bodies.resize(partitions);
  frames.ghosts.resize(partitions);
  frames.ghosts_for.resize(partitions);
  frames.radio.resize(hosts_.size());
  frames.actuation.resize(hosts_.size());
  for (std::size_t p = 0; p < partitions; ++p) {
    frames.all_bodies.push_back(&frames.bodies[p]);
    frames.ghosts[p].resize(physics_[p]->neighbours().size());
  }
  for (std::size_t p = 0; p < partitions; ++p) {
    for (std::size_t i = 0; i < frames.ghosts[p].size(); ++i)
      frames.ghosts_for[physics_[p]->neighbours()[i].value()].push_back(&frames.ghosts[p][i]);
  }
  for (const ActuationFrame& frame : frames.actuation) frames.all_actuation.push_back(&frame);
}

void Engines::load(const Checkpoint& checkpoint) {
  for (const auto& engine : physics_) engine->load(checkpoint.tick, checkpoint.physics());
  radio_.load(checkpoint.tick, checkpoint.radio());
  station_.load(checkpoint.tick, checkpoint.station());
  for (const auto& engine : hosts_) engine->load(checkpoint.tick, checkpoint.behaviours());
}

void Engines::save(std::uint32_t task, proto::CheckpointPart& part) const {
  if (task < physics_.size())
    physics_[task]->save(*part.mutable_physics());
  else if (task == physics_.size())
    radio_.save(*part.mutable_radio());
  else if (task == physics_.size() + 1)
    station_.save(*part.mutable_station());
  else
    hosts_[task - physics_.size() - 2]->save(*part.mutable_behaviours());
}

void Engines::begin(std::span<const TrackerSample> samples) {
  for (std::uint32_t task = 0; task < plan_.federates(); ++task) emit(task, frames_of(first_), samples);
  gather(first_);
}

/// A task steps one engine. Hosts start first because they take longest.
void Engines::step(os::WorkerPool& workers, Tick from, const RunSchedule& schedule,
                   std::span<const TrackerSample> samples, const HostStepped& stepped) {
  using Clock = std::chrono::steady_clock;
  const std::uint32_t tasks = plan_.federates();
  workers.for_each(tasks, [&](std::size_t i) {
    const auto task = tasks - 1 - static_cast<std::uint32_t>(i);
    const auto begun = Clock::now();
    step(task, from, schedule, stepped);
    emit(task, frames_of(from + 1), samples);
    task_ns_[task] += static_cast<std::uint64_t>(std::chrono::nanoseconds(Clock::now() - begun).count());
  });
  gather(from + 1);
}

// Tasks have the numbers of federates: partitions, radio, station, hosts.
void Engines::step(std::uint32_t task, Tick from, const RunSchedule& schedule, const HostStepped& stepped) {
  const Frames& in = frames_of(from);
  const auto partitions = static_cast<std::uint32_t>(physics_.size());
  if (task < partitions) {
    physics_[task]->step(from, {in.ghosts_for[task], in.all_actuation, plan_.any_tracked() ? &in.tracking : nullptr,
                                schedule.memberships(), schedule.relocations()});
  } else if (task == partitions) {
    radio_.step(from, {swarm_, in.overhead});
  } else if (task == partitions + 1) {
    station_.step(from, {swarm_, schedule.overhead_inputs(), schedule.memberships()});
  } else {
    const std::uint32_t host = task - partitions - 2;
    hosts_[host]->step(from, in.radio[host], &swarm_,
                       {plan_.any_tracked() ? &in.tracking : nullptr, schedule.memberships()});
    if (stepped) stepped(host, from);
  }
}

void Engines::emit(std::uint32_t task, Frames& out, std::span<const TrackerSample> samples) {
  const auto partitions = static_cast<std::uint32_t>(physics_.size());
  if (task < partitions) {
    physics_[task]->emit_bodies(out.bodies[task]);
    for (std::size_t i = 0; i < out.ghosts[task].size(); ++i)
      physics_[task]->emit_ghosts(physics_[task]->neighbours()[i], out.ghosts[task][i]);
    hash_parts_[task] = physics_[task]->hash_part();
  } else if (task == partitions) {
    for (std::uint32_t h = 0; h < hosts_.size(); ++h) radio_.emit(HostId{h}, out.radio[h]);
    hash_parts_[task] = radio_.hash_part();
  } else if (task == partitions + 1) {
    station_.emit(out.overhead);
    if (plan_.any_tracked()) {
      station_.take(samples);
      station_.emit(out.tracking);
    }
    hash_parts_[task] = station_.hash_part();
  } else {
    hosts_[task - partitions - 2]->emit(out.actuation[task - partitions - 2]);
    hash_parts_[task] = hosts_[task - partitions - 2]->hash_part();
  }
}

void Engines::gather(Tick now) {
  swarm_.gather(now, frames_of(now).all_bodies);
  swarm_.gather(frames_of(now).all_actuation);
}

std::uint64_t Engines::hash_sum() const {
  std::uint64_t sum = 0;
  for (const std::uint64_t part : hash_parts_) sum += part;
  return sum;
}

std::uint32_t Engines::robots_failed() const {
  std::uint32_t failed = 0;
  for (const auto& engine : hosts_) failed += engine->robots_failed();
  return failed;
}

std::uint64_t Engines::bodies_without_space() const {
  std::uint64_t bodies = 0;
  for (const auto& engine : physics_) bodies += engine->bodies_without_space();
  return bodies;
}

void Engines::add_work(RunTotals& totals) const {
  for (std::uint32_t task = 0; task < task_ns_.size(); ++task) {
    const Work work = task < physics_.size()        ? Work::kPhysics
                      : task == physics_.size()     ? Work::kRadio
                      : task == physics_.size() + 1 ? Work::kStation
                                                    : Work::kBehaviours;
    totals.work_ns[static_cast<std::size_t>(work)] += task_ns_[task];
  }
}

}  // namespace kilotwin::local
