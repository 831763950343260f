#include "clients/recorder/run_directory.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <system_error>

#include "clients/recorder/file.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

namespace fs = std::filesystem;

/// Whether the directory is this run's from now on. The mark is `programs`, which only one of several can make, so
/// that also an empty directory that was there before goes to one run alone.
bool claim(const fs::path& directory) {
  const auto refuse = [](const fs::path& what) {
    return RunError(
        fmt::format("{}: cannot be created: {}; choose another place with --out", what.string(), system_reason()));
  };
  if (::mkdir(directory.c_str(), 0777) != 0) {
    if (errno != EEXIST) throw refuse(directory);
    std::error_code error;
    const bool empty = fs::is_empty(directory, error);
    if (error) throw RunError(fmt::format("{}: cannot be read: {}", directory.string(), error.message()));
    if (!empty) return false;
  }
  const fs::path mark = directory / "programs";
  if (::mkdir(mark.c_str(), 0777) == 0) return true;
  if (errno != EEXIST) throw refuse(mark);
  return false;
}

}  // namespace

fs::path RunDirectory::default_path(std::string_view name, std::uint64_t seed) {
  return fs::path("runs") / fmt::format("{}-{}", name, seed);
}

RunDirectory RunDirectory::create(const fs::path& wanted) {
  if (wanted.empty()) throw UserError("--out: an empty path; expected a directory to write the run to");
  fs::path stem = wanted.lexically_normal();
  if (!stem.has_filename()) stem = stem.parent_path();  // "out/" is "out"
  std::error_code error;
  if (stem.filename() == "." || stem.filename() == ".." || !stem.has_filename())
    stem = fs::canonical(stem.empty() ? "/" : stem, error);
  if (error) throw RunError(fmt::format("{}: cannot be read: {}", wanted.string(), error.message()));
  if (stem.has_parent_path()) fs::create_directories(stem.parent_path(), error);
  if (error) {
    throw RunError(fmt::format("{}: cannot be created: {}; choose another place with --out",
                               stem.parent_path().string(), error.message()));
  }
  fs::path directory = stem;
  for (std::uint64_t number = 2;; ++number) {
    if (fs::exists(directory, error) && !fs::is_directory(directory, error)) {
      if (directory == stem)
        throw UserError(fmt::format("{}: is a file; expected a directory to write the run to", stem.string()));
    } else if (claim(directory)) {
      return RunDirectory(directory);
    }
    directory = stem;
    directory += fmt::format("-{}", number);
  }
}

RunDirectory RunDirectory::open(const fs::path& run, Needs needs) {
  std::error_code error;
  const fs::file_status status = fs::status(run, error);
  if (!fs::exists(status)) {
    throw UserError(
        fmt::format("{}: does not exist; expected the directory of a run, as runs/NAME-SEED", run.string()));
  }
  RunDirectory opened(run);
  if (!fs::is_directory(status)) {
    opened.directory_ = run.has_parent_path() ? run.parent_path() : fs::path(".");
    opened.recording_ = run;
  }
  const fs::path file = needs == Needs::kRecording ? opened.recording_ : opened.manifest();
  if (!fs::exists(file, error)) {
    throw UserError(
        fmt::format("{}: not a run directory, it has no {}; expected what `kilotwin run` wrote, as runs/NAME-SEED",
                    opened.directory_.string(), file.filename().string()));
  }
  return opened;
}

fs::path RunDirectory::checkpoint(Tick tick) const { return checkpoints() / fmt::format("{:012}", tick.count()); }

}  // namespace kilotwin::recorder
