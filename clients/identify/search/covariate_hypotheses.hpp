/// The hypotheses of each covariate or group of covariates. Who calls them calls them in one order: where two explain as much,
/// the first is taken.
#pragma once

#include <vector>

#include "clients/identify/search/dictionary_builder.hpp"

namespace kilotwin::identify {

// Time and place (hypotheses_of_time_and_place.cpp).

/// Returns the places of a drift's first columns, along x and along y.
std::vector<Eigen::Index> hypotheses_of_time(DictionaryMaker&, const Extent&);
/// Returns the same.
std::vector<Eigen::Index> hypotheses_of_place(DictionaryMaker&, const Extent&);
void hypotheses_of_heading(DictionaryMaker&, const Extent&);
/// A constant drift, alone and beside drifts in time and in place.
void hypotheses_of_drift(DictionaryMaker&, const Extent&, const std::vector<Eigen::Index>& in_time,
                         const std::vector<Eigen::Index>& in_place);

// What robots are told and were told (hypotheses_of_commands.cpp).

/// How long motors ran.
void hypotheses_of_use(DictionaryMaker&, const Extent&);
void hypotheses_of_commands(DictionaryMaker&, const Extent&);
/// What came before: in constant amounts or in curves since the command, whatever it does now, and going straight.
void hypotheses_of_history(DictionaryMaker&, const Extent&);
/// What motors did lately, which fades: they warm up and cool down, recover, turned more to one side than to the other.
void hypotheses_of_lately(DictionaryMaker&, const Extent&);

// Others (hypotheses_of_neighbours.cpp).

void hypotheses_of_neighbours(DictionaryMaker&, const Extent&);
/// Floors that remember who trod on them.
void hypotheses_of_floor(DictionaryMaker&);

// Which robot, which run (hypotheses_of_robots.cpp).

void hypotheses_of_robots(DictionaryMaker&, const Extent&);
/// What is set up anew for each run. A shift or turn of all that is measured shows nowhere.
void hypotheses_of_runs(DictionaryMaker&, const Extent&);

// What is found already (hypotheses_of_found.cpp).

/// What is larger for some than for others: an amount for each robot, and for each command.
void hypotheses_of_found(DictionaryMaker&, const Extent&, const std::vector<Term>& found);

}  // namespace kilotwin::identify
