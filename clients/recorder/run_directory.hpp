/// RunDirectory: the files of one run.
///   manifest.pb      the experiment as resolved, for machines: idl/manifest.proto
///   experiment.txtpb the experiment as run; it runs again from there
///   programs/        the behaviours as built, SHA256.so, and firmware as given, SHA256.elf or .hex
///   recording.ktrec  states and events over time: idl/recording.proto
///   provenance.json  by what, when and where the run was prepared: clients/recorder/provenance.hpp
///   summary.json     clients/recorder/summary.hpp
///   picture.svg      clients/recorder/picture.hpp
///   checkpoints/     one directory per checkpoint, named by its tick
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/time.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::recorder {

class RunDirectory {
 public:
  /// What create() does where the directory that is wanted exists and is not empty.
  enum class Existing {
    kNumber,   ///< it takes the first of wanted-2, wanted-3... that does not exist or is empty
    kRefuse,   ///< it throws UserError
    kReplace,  ///< it removes the directory first, where Kilotwin has written it, else it throws UserError
  };
  /// Makes a directory for new results, and `programs` in it. Of several that start at the same time each gets its own.
  /// Throws RunError where none can be made, UserError where `wanted` is a file.
  [[nodiscard]] static RunDirectory create(const std::filesystem::path& wanted, Existing = Existing::kNumber);
  /// runs/NAME-SEED: the directory of runs without --out.
  [[nodiscard]] static std::filesystem::path default_path(std::string_view name, std::uint64_t seed);

  enum class Needs { kRecording, kManifest };
  /// A run that exists: its directory, or the recording in it (under whatever name). Throws UserError with what was
  /// expected where the file in need is not there.
  [[nodiscard]] static RunDirectory open(const std::filesystem::path& run, Needs needs);

  [[nodiscard]] const std::filesystem::path& path() const { return directory_; }
  [[nodiscard]] const std::filesystem::path& recording() const { return recording_; }
  [[nodiscard]] std::filesystem::path manifest() const { return directory_ / "manifest.pb"; }
  [[nodiscard]] std::filesystem::path experiment() const { return directory_ / "experiment.txtpb"; }
  [[nodiscard]] std::filesystem::path programs() const { return directory_ / "programs"; }
  [[nodiscard]] std::filesystem::path program(const Program& program) const { return programs() / program.file(); }
  [[nodiscard]] std::filesystem::path provenance() const { return directory_ / "provenance.json"; }
  [[nodiscard]] std::filesystem::path summary() const { return directory_ / "summary.json"; }
  [[nodiscard]] std::filesystem::path picture() const { return directory_ / "picture.svg"; }

  /// Throws RunError where it cannot be written.
  void write_manifest(const proto::Manifest& manifest) const;
  /// Throws UserError that names the file, and the place where it is damaged.
  [[nodiscard]] proto::Manifest read_manifest() const;

 private:
  explicit RunDirectory(std::filesystem::path directory)
      : directory_(std::move(directory)), recording_(directory_ / "recording.ktrec") {}
  std::filesystem::path directory_, recording_;
};

}  // namespace kilotwin::recorder
