/// The hypotheses by covariate. The order of the calls is fixed: of two hypotheses with equal evidence, the first
/// is chosen.
#pragma once

#include <vector>

#include "clients/identify/search/dictionary_builder.hpp"

namespace kilotwin::identify {

// Time and place (time_place_hypotheses.cpp).

/// Returns the first columns of the drift along x and along y.
std::vector<Eigen::Index> add_time_hypotheses(DictionaryBuilder&, const Extent&);
/// Returns the first columns of the drift along x and along y.
std::vector<Eigen::Index> add_place_hypotheses(DictionaryBuilder&, const Extent&);
void add_heading_hypotheses(DictionaryBuilder&, const Extent&);
/// Effects on one wheel alone (wheel_hypotheses.cpp).
void add_wheel_hypotheses(DictionaryBuilder&, const Extent&);
/// A constant drift, alone and together with drifts over time and over place.
void add_drift_hypotheses(DictionaryBuilder&, const Extent&, const std::vector<Eigen::Index>& in_time,
                          const std::vector<Eigen::Index>& in_place);

// Commands and their history (command_hypotheses.cpp).

/// Total motor-on time.
void add_motor_time_hypotheses(DictionaryBuilder&, const Extent&);
void add_command_hypotheses(DictionaryBuilder&, const Extent&);
/// The previous command: constants, or curves of the time since the change, under any command and under straight.
void add_history_hypotheses(DictionaryBuilder&, const Extent&);
/// Wheels that change from the speed under the previous command to that under the present one within seconds, also when
/// robots stop.
void add_inertia_hypotheses(DictionaryBuilder&, const Extent&);
/// Discounted motor-on time: motors warm up and cool down, batteries recover, turns accumulate to one side.
void add_discounted_motor_time_hypotheses(DictionaryBuilder&, const Extent&);

// Neighbours and traffic (neighbour_hypotheses.cpp).

void add_neighbour_hypotheses(DictionaryBuilder&, const Extent&);
/// Neighbours of which only some count: those that drive, those at rest, or one robot.
void add_some_neighbours_hypotheses(DictionaryBuilder&, const Extent&);
/// Driven time per floor cell.
void add_traffic_hypotheses(DictionaryBuilder&);

// Robots and runs (robot_hypotheses.cpp).

void add_robot_hypotheses(DictionaryBuilder&, const Extent&);
/// Differences between runs. Constant displacements and rotations of the image are not identifiable.
void add_run_hypotheses(DictionaryBuilder&, const Extent&);

// Amplitudes of accepted effects (amplitude_hypotheses.cpp).

/// Amplitudes per robot, per command, over time, place and heading.
void add_amplitude_hypotheses(DictionaryBuilder&, const Extent&, const std::vector<Term>& found);

}  // namespace kilotwin::identify
