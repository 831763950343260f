/// RunDirectory: the files of one run.
///   manifest.pb      the resolved experiment, for programs: idl/manifest.proto
///   experiment.txtpb the experiment as run; it can be run again from there
///   programs/        the built behaviours, SHA256.so, and the given firmware, SHA256.elf or .hex
///   plugins/         plugins of the station as built, SHA256.so, and SHA256, the program that runs them
///   station-N.*      log (.tsv) and report (.json) of virtual environment N
///   recording.ktrec  states and events over time: idl/recording.proto
///   provenance.json  clients/recorder/provenance.hpp
///   summary.json     clients/recorder/summary.hpp
///   alarms.csv, .txt alarms of the residual monitor as a table and as lines; alarms-replayed.*: of the last replay
///   residuals.csv    residuals of the monitor; residuals-replayed.csv: of the last replay
///   picture.svg      clients/recorder/picture.hpp
///   animation.svg    clients/recorder/animation.hpp
///   report.html      what happened, on one page: clients/cli/run_report.hpp
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
  /// Behaviour of create() if the directory exists and is not empty.
  enum class Existing {
    kNumber,   ///< use the first of wanted-2, wanted-3... that does not exist or is empty
    kRefuse,   ///< throw UserError
    kReplace,  ///< remove the directory first if Kilotwin wrote it, otherwise throw UserError
  };
  /// Makes a directory for results, with the subdirectory `programs`. Concurrent calls get distinct directories.
  /// Throws RunError if no directory can be made, UserError if `wanted` is a file.
  [[nodiscard]] static RunDirectory create(const std::filesystem::path& wanted, Existing = Existing::kNumber);
  /// runs/NAME-SEED: the default directory, without --out.
  [[nodiscard]] static std::filesystem::path default_path(std::string_view name, std::uint64_t seed);

  enum class Needs { kRecording, kManifest };
  /// Opens an existing run by its directory, or by the recording in it under any name. Throws UserError, with the expected
  /// file, if the file in `needs` does not exist.
  [[nodiscard]] static RunDirectory open(const std::filesystem::path& run, Needs needs);

  [[nodiscard]] const std::filesystem::path& path() const { return directory_; }
  [[nodiscard]] const std::filesystem::path& recording() const { return recording_; }
  [[nodiscard]] std::filesystem::path manifest() const { return directory_ / "manifest.pb"; }
  [[nodiscard]] std::filesystem::path experiment() const { return directory_ / "experiment.txtpb"; }
  [[nodiscard]] std::filesystem::path programs() const { return directory_ / "programs"; }
  [[nodiscard]] std::filesystem::path program(const Program& program) const { return programs() / program.file(); }
  [[nodiscard]] std::filesystem::path provenance() const { return directory_ / "provenance.json"; }
  [[nodiscard]] std::filesystem::path summary() const { return directory_ / "summary.json"; }
  [[nodiscard]] std::filesystem::path alarms() const { return directory_ / "alarms.csv"; }
  [[nodiscard]] std::filesystem::path picture() const { return directory_ / "picture.svg"; }
  [[nodiscard]] std::filesystem::path animation() const { return directory_ / "animation.svg"; }
  [[nodiscard]] std::filesystem::path report() const { return directory_ / "report.html"; }

  /// Throws RunError if it cannot be written.
  void write_manifest(const proto::Manifest& manifest) const;
  /// Throws UserError with the file and the position of the damage.
  [[nodiscard]] proto::Manifest read_manifest() const;

 private:
  explicit RunDirectory(std::filesystem::path directory)
      : directory_(std::move(directory)), recording_(directory_ / "recording.ktrec") {}
  std::filesystem::path directory_, recording_;
};

}  // namespace kilotwin::recorder
