/// A model of the floor fitted by simulation: the statistics of simulated runs are brought near those of measured ones.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/identify/kilogrid/floor_target.hpp"

namespace kilotwin::kilogrid {

/// What the neighbourhood of a model says about a candidate.
struct CandidateScore {
  std::size_t candidate;
  double gain;                 ///< by how much it would lower the misfit
  std::vector<double> values;  ///< of its parameters
};

using FloorProgress = std::function<void(const std::string&)>;

/// Regresses the statistics on all parameters over a design of simulated runs, and goes to where they fit best; `rounds` times
/// with ever smaller steps. Returns the misfit at the end, by new simulations.
double fit(FloorModel&, const FloorTarget&, int rounds, double width, std::uint64_t seed, const FloorProgress&);

/// The effect of walls, part by part of the rim: slower where robots were measured to stay longer than they do in the model. It
/// is kept where the misfit falls by `least_gain` at least. Returns the misfit.
double fit_walls(FloorModel&, const FloorTarget&, int rounds, std::uint64_t seed, double least_gain,
                 const FloorProgress&);

/// Candidates that the model lacks, one after the other by what each removes of the misfit beside those before it and with the
/// model refitted; ends where the next would remove less than `least_gain`. `gains`: what each candidate would remove beside
/// those chosen; of those, what it removed when chosen.
[[nodiscard]] std::vector<CandidateScore> choose(const FloorModel&, const std::vector<FloorTerm>& candidates,
                                                 const FloorTarget&, double least_gain, std::uint64_t seed,
                                                 const FloorProgress&, std::vector<double>* gains = nullptr);

}  // namespace kilotwin::kilogrid
