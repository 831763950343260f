/// All programs of a run, loaded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/plan/plan.hpp"
#include "services/behaviours/image.hpp"

namespace kilotwin::behaviours {

class ProgramSet {
 public:
  /// Loads programs/SHA256.so of the run directory for each program of the plan, except firmware. Addresses in memory follow
  /// from the contents and order of the programs alone: so checkpoints hold anywhere, and runs of different programs seldom
  /// collide in one process. Throws UserError where a file is missing, is not what its name says, or is no program; RunError where memory is
  /// short or the addresses are taken.
  [[nodiscard]] static std::shared_ptr<ProgramSet> load(const RunPlan&, const std::filesystem::path& run_directory);

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(programs_.size()); }
  /// `index` as in RunPlan::program_of; not of firmware.
  [[nodiscard]] const Program& program(std::uint32_t index) const { return *programs_[index]; }

 private:
  std::vector<std::shared_ptr<Program>> programs_;
};

}  // namespace kilotwin::behaviours
