/// The hypotheses by covariate. The order of the calls is fixed: of two hypotheses with equal evidence, the first
/// is chosen.
#pragma once

#include <vector>

#include "clients/identify/search/dictionary_builder.hpp"

namespace kilotwin::identify {

// Time and place (time_place_hypotheses.cpp).

/// Returns the first columns of the drift along x and along y.
std::vector<Eigen::Index> hypotheses_of_time(DictionaryMaker&, const Extent&);
/// Returns the first columns of the drift along x and along y.
std::vector<Eigen::Index> hypotheses_of_place(DictionaryMaker&, const Extent&);
void hypotheses_of_heading(DictionaryMaker&, const Extent&);
/// A constant drift, alone and together with drifts over time and over place.
void hypotheses_of_drift(DictionaryMaker&, const Extent&, const std::vector<Eigen::Index>& in_time,
                         const std::vector<Eigen::Index>& in_place);

// Commands and their history (command_hypotheses.cpp).

/// Total motor-on time.
void hypotheses_of_use(DictionaryMaker&, const Extent&);
void hypotheses_of_commands(DictionaryMaker&, const Extent&);
/// The previous command: constants, or curves of the time since the change, under any command and under straight.
void hypotheses_of_history(DictionaryMaker&, const Extent&);
/// Discounted motor-on time: motors warm up and cool down, batteries recover, turns accumulate to one side.
void hypotheses_of_lately(DictionaryMaker&, const Extent&);

// Neighbours and traffic (neighbour_hypotheses.cpp).

void hypotheses_of_neighbours(DictionaryMaker&, const Extent&);
/// Driven time per floor cell.
void hypotheses_of_floor(DictionaryMaker&);

// Robots and runs (robot_hypotheses.cpp).

void hypotheses_of_robots(DictionaryMaker&, const Extent&);
/// Differences between runs. Constant displacements and rotations of the image are not identifiable.
void hypotheses_of_runs(DictionaryMaker&, const Extent&);

// Amplitudes of accepted effects (amplitude_hypotheses.cpp).

/// Amplitudes per robot, per command, over time, place and heading.
void hypotheses_of_found(DictionaryMaker&, const Extent&, const std::vector<Term>& found);

}  // namespace kilotwin::identify
