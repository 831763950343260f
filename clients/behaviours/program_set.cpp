#include "clients/behaviours/program_set.hpp"

#include "clients/behaviours/files.hpp"
#include "clients/behaviours/sha256.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {

std::shared_ptr<ProgramSet> ProgramSet::load(const proto::Manifest& manifest, const std::filesystem::path& run_directory) {
  auto set = std::make_shared<ProgramSet>();
  std::uint64_t address = kFirstAddress;
  for (const proto::Program& program : manifest.program()) {
    const std::filesystem::path path = run_directory / "programs" / (program.sha256() + ".so");
    const auto octets = read_file(path);
    if (!octets) {
      throw UserError(path.string() + ": cannot be read; the run directory must hold the programs of its manifest");
    }
    if (sha256_hex(*octets) != program.sha256()) {
      throw UserError(path.string() + ": its SHA-256 is not what its name says; copy it again from where the run was prepared");
    }
    set->programs_.push_back(Program::load(*octets, program.path(), program.sha256(), address));
    address = set->programs_.back()->end;
  }
  return set;
}

}  // namespace kilotwin::behaviours
