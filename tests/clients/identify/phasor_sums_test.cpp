// Sums of phasors equal the plain sums, for numbers of points around those of a block.
#include "clients/identify/search/phasor_sums.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kilotwin::identify {
namespace {

TEST(PhasorSums, EqualThePlainSums) {
  for (const Eigen::Index points : {1, 255, 256, 257, 1000}) {
    Eigen::ArrayXcd at(points), by(points);
    for (Eigen::Index i = 0; i < points; ++i) {
      at[i] = std::polar(1 + 0.5 * std::sin(0.3 * static_cast<double>(i)), 0.7 * static_cast<double>(i));
      by[i] = std::polar(1.0, std::cos(static_cast<double>(i)));
    }
    // Sums are added to what is there.
    std::vector<std::complex<double>> sums(40, {1, 2});
    add_phasor_sums(at, by, sums);
    for (std::size_t w = 0; w < sums.size(); ++w) {
      std::complex<double> plain{1, 2};
      for (Eigen::Index i = 0; i < points; ++i) plain += at[i] * std::pow(by[i], static_cast<int>(w));
      EXPECT_NEAR(std::abs(sums[w] - plain), 0, 1e-9) << points << " points, frequency " << w;
    }
  }
}

}  // namespace
}  // namespace kilotwin::identify
