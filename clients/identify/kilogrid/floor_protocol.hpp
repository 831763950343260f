/// The protocol of evaluation on floors: which days fit and search, which choose the model, and which give the error once.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/kilogrid/floor_validation.hpp"

namespace kilotwin::kilogrid {

/// Disjoint days in order of their names.
struct FloorDays {
  std::vector<FloorRun> fit;       ///< of the fit and the search
  std::vector<FloorRun> choose;    ///< choose among the models of the search
  std::vector<FloorRun> report;    ///< give the error
  bool chose_on_reported = false;  ///< too few days: those that choose are those that report

  /// The days of the fit, then those that choose; valid as long as this object.
  [[nodiscard]] std::vector<const FloorRun*> searched() const;
};

/// Divides days. `test` not empty: all of it reports, and every fourth day of `train` chooses if there are three or more. `test`
/// empty: every third day of `train` is held out; of these every second one reports, the others choose; one alone does both.
/// Throws UserError if no day is left for the fit or for the report.
[[nodiscard]] FloorDays divided(std::vector<FloorRun> train, std::vector<FloorRun> test);

/// A model on the path of a search, on the days that choose.
struct FloorScore {
  double misfit;
  double rmse_mm;      ///< of the prediction of cells
  Excess excess = {};  ///< of that over the base model's
};
/// The index of the smallest model whose misfit is within 2 % of the least, the base model first. A model is never chosen over the
/// base model if its misfit is not lower, or if it predicts cells worse: by more than 5 %, or by more than 1 % and more
/// than two standard errors.
[[nodiscard]] std::size_t chosen_model(const std::vector<FloorScore>& path);

/// A record of the days on which searches were reported, in a file beside the data: a day that was looked at before is no longer
/// unseen.
class OpenedDays {
 public:
  /// The file's name in the directory of the data.
  static constexpr const char* kFile = "opened-days.txt";
  /// An empty path: no record.
  explicit OpenedDays(std::filesystem::path file) : file_(std::move(file)) {}

  struct Opened {
    std::size_t before = 0;  ///< other searches that were reported on any of the days
    std::string unwritable;  ///< why the record could not be written; empty: it was
  };
  /// Notes that a search is reported on these days. `searched`: all days that fit or choose. A search with the same days, options
  /// and program counts once, because it gives the same result. `options`: them, in any words. `today`: a date for readers of the
  /// file.
  [[nodiscard]] Opened open(const std::vector<FloorRun>& report, const std::vector<const FloorRun*>& searched,
                            const std::string& options, const std::string& today) const;

 private:
  std::filesystem::path file_;
};

}  // namespace kilotwin::kilogrid
