/// Sums of phasors at equally spaced frequencies: the inner loop of a periodogram of points at irregular times.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace kilotwin::identify {

/// Adds to each sums[w] the sum over i of at[i] by[i]^w. `at` and `by` have one entry per point.
/// The result has the same bits on every instruction set.
void add_phasor_sums(const Eigen::ArrayXcd& at, const Eigen::ArrayXcd& by, std::vector<std::complex<double>>& sums);

}  // namespace kilotwin::identify
