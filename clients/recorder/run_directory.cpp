#include "clients/recorder/run_directory.hpp"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/checksummed_file.hpp"
#include "core/os/files.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::recorder {
namespace {

namespace fs = std::filesystem;

/// Format 1 had no checksums.
constexpr FileKind kManifestFile{"KTWNMANI", 2, "the manifest of a run", "prepare the run again"};

/// Whether this run has claimed the directory. The mark is the subdirectory `programs`, which only one of several processes
/// can create. So an existing empty directory also goes to one run only.
bool claim(const fs::path& directory) {
  const auto refuse = [](const fs::path& what) {
    return RunError(fmt::format("{}: cannot be created: {}; choose another place with --out", what.string(),
                                os::system_reason()));
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

/// Whether Kilotwin wrote the directory: a run, a sweep of runs, or results of `identify`.
bool is_result(const fs::path& directory) {
  constexpr const char* kMarks[] = {"manifest.pb", "programs", "sweep.csv", "result.json"};
  std::error_code ignored;
  const auto marked = [&](const fs::path& place) {
    return std::any_of(std::begin(kMarks), std::end(kMarks),
                       [&](const char* mark) { return fs::exists(place / mark, ignored); });
  };
  if (marked(directory)) return true;
  const fs::directory_iterator entries(directory, ignored);
  return std::any_of(begin(entries), end(entries), [&](const fs::directory_entry& e) { return marked(e.path()); });
}

void remove_results(const fs::path& directory) {
  std::error_code error;
  if (fs::is_empty(directory, error) || error) return;
  if (!is_result(directory)) {
    throw UserError(
        fmt::format("{}: --force replaces only what kilotwin has written, and this is something else; give "
                    "another --out",
                    directory.string()));
  }
  fs::remove_all(directory, error);
  if (error) throw RunError(fmt::format("{}: cannot be removed: {}", directory.string(), error.message()));
}

}  // namespace

fs::path RunDirectory::default_path(std::string_view name, std::uint64_t seed) {
  return fs::path("runs") / fmt::format("{}-{}", name, seed);
}

RunDirectory RunDirectory::create(const fs::path& wanted, Existing existing) {
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
  if (existing == Existing::kReplace && fs::is_directory(stem, error)) remove_results(stem);
  fs::path directory = stem;
  for (std::uint64_t number = 2;; ++number) {
    if (fs::exists(directory, error) && !fs::is_directory(directory, error)) {
      if (directory == stem)
        throw UserError(fmt::format("{}: is a file; expected a directory to write the run to", stem.string()));
    } else if (claim(directory)) {
      return RunDirectory(directory);
    } else if (existing != Existing::kNumber) {
      throw UserError(
          fmt::format("{}: exists and is not empty; give another --out, or --force to replace it", stem.string()));
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

void RunDirectory::write_manifest(const proto::Manifest& given) const {
  write_checksummed(manifest(), kManifestFile, given.SerializeAsString());
}

proto::Manifest RunDirectory::read_manifest() const {
  proto::Manifest read;
  const google::protobuf::LogSilencer quiet;  // protobuf would report text that is not UTF-8 on stderr
  if (!read.ParseFromString(read_checksummed(manifest(), kManifestFile))) {
    throw UserError(fmt::format("{}: is not {} that this program wrote; {}", manifest().string(),
                                kManifestFile.name, kManifestFile.remedy));
  }
  return read;
}

}  // namespace kilotwin::recorder
