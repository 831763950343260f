/// SweepReport: a table of summaries and observables with standard errors over runs, curves over time, plots, and a page.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/cli/sweep_points.hpp"
#include "clients/recorder/observables.hpp"
#include "clients/recorder/provenance.hpp"
#include "clients/recorder/statistics.hpp"
#include "clients/report/plot.hpp"

namespace kilotwin::cli {

class SweepReport {
 public:
  /// `plotted`: the observable that the plots show.
  SweepReport(std::string name, std::vector<SweepPoint> points, recorder::Observable plotted);

  /// Adds a run that succeeded. Throws if its files cannot be read.
  void add(std::size_t point, const std::filesystem::path& run);
  /// Number of runs added.
  [[nodiscard]] std::size_t runs() const { return runs_; }

  /// The table, for people: a line per point.
  [[nodiscard]] std::string table() const;
  /// The same on a page, with the plots and how the sweep was made.
  [[nodiscard]] std::string page(const recorder::Provenance& provenance) const;
  /// Writes sweep.csv, curves.csv, sweep.svg, response.svg where has_response(), and report.html. Throws RunError; the tables
  /// are written first.
  void write(const std::filesystem::path& directory, const recorder::Provenance& provenance) const;
  /// Per point, every observable at the end of the runs and the sums of their summaries, means with standard errors.
  [[nodiscard]] std::string table_csv() const;
  /// The same over time: a row per point and recorded state.
  [[nodiscard]] std::string curves_csv() const;
  /// The plotted observable over time, a curve per point.
  [[nodiscard]] Plot curves() const;
  /// Whether a field was swept over numbers, so that there is something to plot against it.
  [[nodiscard]] bool has_response() const { return response_field_ < most_fields_; }
  /// The plotted observable at the end of the runs against that field, a line per combination of the others.
  [[nodiscard]] Plot response() const;

 private:
  static constexpr std::size_t most_fields_ = static_cast<std::size_t>(-1);
  using Samples = std::array<recorder::Sample, recorder::kObservables.size()>;

  struct Observed {
    Samples at_end;
    std::vector<Samples> over_time;  // per recorded state
    std::vector<double> time_s;
    recorder::Sample sent, received, collided, failed, realtime;
  };

  [[nodiscard]] std::vector<std::vector<std::string>> rows() const;
  [[nodiscard]] std::string name_of(std::size_t point) const;
  /// Its fields that not all points have alike; without the field's name where that is the only one.
  [[nodiscard]] std::string short_name_of(std::size_t point) const;
  /// The fields that all points have alike, as they were set.
  [[nodiscard]] std::string constant() const;
  [[nodiscard]] std::string runs_text() const;
  [[nodiscard]] Plot plot() const;

  std::string name_;
  std::vector<SweepPoint> points_;
  recorder::Observable plotted_;
  std::vector<Observed> observed_;
  std::size_t runs_ = 0;
  std::size_t response_field_ = most_fields_;  // index into a point
  std::vector<std::size_t> varying_;           // fields that differ between points, ascending
};

}  // namespace kilotwin::cli
