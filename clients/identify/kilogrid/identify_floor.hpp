/// Identification from Kilogrid runs: the base model is fitted by simulation, then effects are selected one by
/// one. Days that took no part choose among the models of this search. Other days give the errors, once (floor_protocol.hpp):
/// statistics, cell predictions and their likelihood, and a classifier two-sample test.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "clients/identify/study.hpp"

namespace kilotwin::kilogrid {

/// The study of Kilogrid runs. `test` empty: holds out every third run of `train`. `ledger`: where openings of reported days are noted;
/// empty: nowhere.
[[nodiscard]] std::unique_ptr<identify::Study> floor_study(std::vector<FloorRun> train, std::vector<FloorRun> test,
                                                           const identify::Options&,
                                                           std::filesystem::path ledger = {});

}  // namespace kilotwin::kilogrid
