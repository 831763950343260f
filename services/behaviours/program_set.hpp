/// The loaded programs of a run.
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
  /// Loads programs/SHA256.so of the run directory for each program of the plan, except firmware. The addresses in memory depend
  /// only on the contents and the order of the programs. Checkpoints are therefore valid on every machine, and runs of different
  /// programs seldom collide in one process. Throws UserError if a file is missing, does not match the SHA-256 in its name, or is
  /// no program. Throws RunError if memory is short or the addresses are in use.
  [[nodiscard]] static std::shared_ptr<ProgramSet> load(const RunPlan&, const std::filesystem::path& run_directory);

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(programs_.size()); }
  /// `index`: RunPlan::program_of() of a robot that does not run firmware.
  [[nodiscard]] const Program& program(std::uint32_t index) const { return *programs_[index]; }

 private:
  std::vector<std::shared_ptr<Program>> programs_;
};

}  // namespace kilotwin::behaviours
