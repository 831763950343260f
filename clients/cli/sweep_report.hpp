/// SweepReport: tables of observables with standard errors over runs, curves over time, plots, and a page.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/sweep_colours.hpp"
#include "clients/cli/sweep_designs.hpp"
#include "clients/cli/sweep_points.hpp"
#include "clients/recorder/observables.hpp"
#include "clients/recorder/provenance.hpp"
#include "clients/report/plot.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::cli {

enum class AxisScale : std::uint8_t { kAutomatic, kLinear, kLogarithmic };

/// How the plots of a sweep show an observable.
struct SweepPlots {
  recorder::Observable observable = recorder::Observable::kMsd;
  std::string own;  ///< an observable of the experiment, instead
  /// A curve and a colour for each value of this swept field, or for each "group" of robots. All points of that value, or that group,
  /// are one sample. Empty: a curve per point.
  std::string colour_by;
  /// Of the swept field. Automatic: logarithmic where the values have equal ratios.
  AxisScale x = AxisScale::kAutomatic;
  bool y_logarithmic = false;
  /// Of a sweep over several models: whether a larger value of the observable is better. Nothing: there are no designs to rank.
  std::optional<bool> largest;
};

class SweepReport {
 public:
  /// Throws UserError if no such field is swept.
  SweepReport(std::string name, std::vector<SweepPoint> points, SweepPlots plots);

  /// Adds a run that succeeded. Throws if its files cannot be read, or it has other observables than the runs before.
  void add(std::size_t point, std::uint64_t seed, const std::filesystem::path& run);
  /// Adds a run that failed, for runs.csv.
  void add_failed(std::size_t point, std::uint64_t seed, const std::filesystem::path& run, const std::string& why);
  /// Number of runs added.
  [[nodiscard]] std::size_t runs() const { return runs_; }
  /// Number of those in which robots failed.
  [[nodiscard]] std::size_t runs_with_failed_robots() const;

  /// The table for the terminal: one line per point; with several models one more per design.
  [[nodiscard]] std::string table() const;
  /// A page with the table, the plots and the provenance.
  [[nodiscard]] std::string page(const recorder::Provenance& provenance) const;
  /// Writes runs.csv and, where a run succeeded, sweep.csv, curves.csv, and designs.csv if there are designs. With gnuplot also sweep.svg, response.svg if has_response(),
  /// and report.html. Returns whether it wrote plots. Throws RunError; the tables are written first.
  [[nodiscard]] bool write(const std::filesystem::path& directory, const recorder::Provenance& provenance) const;
  /// One row per point: every observable at the end of the runs and the summaries' counts, each with mean and standard error.
  [[nodiscard]] std::string table_csv() const;
  /// One row per run: its directory, the swept fields, seed, whether it is well, every observable at its end, counts, state hash.
  [[nodiscard]] std::string runs_csv() const;
  /// One row per point and recorded state: every observable with mean and standard error.
  [[nodiscard]] std::string curves_csv() const;
  /// The designs of a sweep over several models, by rank; none without such.
  [[nodiscard]] std::vector<Design> designs() const;
  /// The plotted observable over time, one curve per point.
  [[nodiscard]] Plot curves() const;
  /// Whether a field was swept over numbers, so that response() can plot against it.
  [[nodiscard]] bool has_response() const { return response_field_ < most_fields_; }
  /// The plotted observable at the end of the runs against that field, one line per combination of the other fields.
  [[nodiscard]] Plot response() const;

 private:
  static constexpr std::size_t most_fields_ = static_cast<std::size_t>(-1);
  /// Per observable: those of observables.hpp, then the experiment's.
  using Samples = std::vector<stats::Moments>;

  struct Observed {
    Samples at_end;
    std::vector<Samples> over_time;  // per recorded state
    std::vector<double> time_s;
    stats::Moments sent, received, collided, failed, realtime;
  };

  [[nodiscard]] std::vector<std::vector<std::string>> rows() const;
  [[nodiscard]] std::string name_of(std::size_t point) const;
  /// The values of the fields that differ between points, with the fields' names if there are several.
  [[nodiscard]] std::string short_name_of(std::size_t point) const;
  /// The settings that all points share.
  [[nodiscard]] std::string constant() const;
  [[nodiscard]] std::string runs_text() const;
  [[nodiscard]] Plot plot() const;

  struct Run {
    std::size_t point = 0;
    std::uint64_t seed = 0;
    std::string directory, failure;  ///< failure: empty where it is well
    std::vector<double> at_end;      ///< per observable
    std::uint64_t sent = 0, received = 0, collided = 0, state_hash = 0;
    std::uint32_t robots_failed = 0;
  };
  [[nodiscard]] std::size_t observables() const { return recorder::kObservables.size() + own_.size(); }
  [[nodiscard]] std::size_t plotted() const;
  [[nodiscard]] std::string plotted_name() const;
  [[nodiscard]] std::string csv_header(const std::string& first) const;
  [[nodiscard]] std::string fields_header() const;
  [[nodiscard]] std::string fields_of(std::size_t point) const;

  void choose_response();
  [[nodiscard]] bool x_logarithmic() const;
  /// The plotted observable over time.
  [[nodiscard]] ObservedCurve curve_of(const recorder::ObservableCurves& curves) const;

  std::string name_;
  std::vector<SweepPoint> points_;
  SweepPlots plots_;
  std::vector<std::string> own_;  ///< observables of the experiment
  std::vector<Run> all_runs_;
  std::vector<Observed> observed_;
  std::size_t runs_ = 0;
  std::size_t response_field_ = most_fields_;  // index into a point
  std::vector<std::size_t> varying_;           // fields that differ between points, ascending
  std::optional<SweepColours> colours_;
};

}  // namespace kilotwin::cli
