/// Batch: arenas of one experiment, each with a seed of its own, on all threads. Their states lie in shared memory.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/arenas/arena.hpp"
#include "clients/arenas/shared_arrays.hpp"
#include "core/os/worker_pool.hpp"
#include "services/behaviours/watchdog.hpp"

namespace kilotwin::arenas {

class Batch {
 public:
  /// The plan of the experiment with a seed. All plans have the same programs, robots, and bodies.
  using PlanOf = std::function<std::shared_ptr<const RunPlan>(std::uint64_t seed)>;

  /// One arena per seed. `run_directory` holds the programs. Throws as ProgramSet::load() does.
  Batch(PlanOf plan_of, std::filesystem::path run_directory, std::span<const std::uint64_t> seeds,
        std::uint32_t threads);

  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(arenas_.size()); }
  [[nodiscard]] const RunPlan& plan() const { return arenas_.front()->plan(); }
  /// Arrays by arena: tick, ended, state_hash, robots_failed, sent, received; by arena and robot: x_mm, y_mm, heading_rad, led
  /// (red, green, blue, 0 to 3), motors (left, right, 0 to 255), life_cycle; by arena and movable body: body_x_mm, body_y_mm,
  /// body_heading_rad; variables (variable, arena, robot). `wanted` (arena, robot) is an input: what set_variable() sets.
  [[nodiscard]] const SharedArrays& arrays() const { return arrays_; }
  [[nodiscard]] std::vector<std::string> variables() const;

  /// All arenas that have not ended; each goes as far as its experiment does.
  void step(std::int64_t ticks);
  /// Restarts arenas, each with the seed given beside it.
  void reset(std::span<const std::pair<std::uint32_t, std::uint64_t>> seeds);
  void send(std::span<const std::uint32_t> arenas, const OverheadPacket& packet);
  /// As Arena::place() in each of them. Throws UserError; then none has taken it.
  void place(std::span<const std::uint32_t> arenas, const Relocation& where);
  /// Sets the variable to `wanted`, except where that is NaN. Throws UserError, with the arena, where it cannot; then no robot has
  /// been changed.
  void set_variable(std::size_t index);
  [[nodiscard]] const Arena& arena(std::uint32_t index) const { return *arenas_[index]; }

 private:
  using Arenas = std::vector<std::unique_ptr<Arena>>;

  [[nodiscard]] std::unique_ptr<Arena> begun(std::uint64_t seed);
  [[nodiscard]] Arenas begun(std::span<const std::uint64_t> seeds);
  void show(std::uint32_t index) const;
  void watch();

  PlanOf plan_of_;
  const std::filesystem::path run_directory_;
  std::shared_ptr<behaviours::ProgramSet> programs_;
  Arenas arenas_;
  SharedArrays arrays_;
  os::WorkerPool workers_;
  std::unique_ptr<behaviours::Watchdog> watchdog_;
};

}  // namespace kilotwin::arenas
