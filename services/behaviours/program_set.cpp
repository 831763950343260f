#include "services/behaviours/program_set.hpp"

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {

namespace {

/// An address for `size` octets, derived from the programs' hashes.
std::uint64_t place_for(const std::string& hashes, std::uint64_t size) {
  const std::uint64_t room = kLastAddress - kFirstAddress;
  if (size > room) throw RunError("the programs of this experiment are too large to be in memory together");
  const std::uint64_t places = (room - size) / kAddressStep + 1;
  return kFirstAddress + std::stoull(sha256_hex(hashes).substr(0, 15), nullptr, 16) % places * kAddressStep;
}

}  // namespace

std::shared_ptr<ProgramSet> ProgramSet::load(const RunPlan& plan, const std::filesystem::path& run_directory) {
  std::vector<ElfFile> files;
  std::string hashes;
  std::uint64_t size = 0;
  for (const kilotwin::Program& program : plan.programs()) {
    if (program.firmware) continue;
    const std::filesystem::path path = run_directory / "programs" / program.file();
    const auto octets = os::read_if_there(path);
    if (!octets) {
      throw UserError(path.string() + ": cannot be read; the run directory must hold the programs of its manifest");
    }
    if (sha256_hex(*octets) != program.sha256) {
      throw UserError(path.string() +
                      ": its SHA-256 is not what its name says; copy it again from where the run was prepared");
    }
    files.push_back(ElfFile::parse(*octets, path.string()));
    size += Program::size(files.back());
    hashes += program.sha256 + '\n';
  }
  auto set = std::make_shared<ProgramSet>();
  std::uint64_t address = place_for(hashes, size);
  std::size_t next = 0;
  for (const kilotwin::Program& program : plan.programs()) {
    if (program.firmware) {
      set->programs_.push_back(nullptr);
      continue;
    }
    set->programs_.push_back(Program::load(std::move(files[next++]), program.path, program.sha256, address));
    address = set->programs_.back()->end;
  }
  return set;
}

}  // namespace kilotwin::behaviours
