#include "clients/identify/search/phasor_sums.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace kilotwin::identify {
namespace {

constexpr std::size_t kLanes = 8;  // numbers per vector register of the sums; sum_of_lanes adds exactly so many
/// Points that pass through all frequencies together: few enough for the nearest cache.
constexpr std::size_t kPointsTogether = 256;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// Real and imaginary parts of a block of points, padded with zeros.
struct PhasorBlock {
  std::array<Lanes, kPointsTogether / kLanes> real, imaginary;
  void load(const std::complex<double>* from, std::size_t count) {
    for (std::size_t i = 0; i < kPointsTogether; ++i) {
      const std::complex<double> value = i < count ? from[i] : 0;
      real[i / kLanes][i % kLanes] = value.real();
      imaginary[i / kLanes][i % kLanes] = value.imag();
    }
  }
};

double sum_of_lanes(const Lanes& lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

/// Adds the phasors of a block at all frequencies, and turns them by one frequency after each.
inline __attribute__((always_inline)) void add_block(PhasorBlock& at, const PhasorBlock& by,
                                                     std::complex<double>* sums, std::size_t frequencies) {
  for (std::size_t w = 0; w < frequencies; ++w) {
    Lanes real = {}, imaginary = {};
    for (std::size_t i = 0; i < kPointsTogether / kLanes; ++i) {
      const Lanes a = at.real[i], b = at.imaginary[i], c = by.real[i], d = by.imaginary[i];
      real += a;
      imaginary += b;
      at.real[i] = a * c - b * d;
      at.imaginary[i] = a * d + b * c;
    }
    sums[w] += std::complex<double>(sum_of_lanes(real), sum_of_lanes(imaginary));
  }
}

using AddBlock = void (*)(PhasorBlock&, const PhasorBlock&, std::complex<double>*, std::size_t);

#if defined(__x86_64__)
__attribute__((target("avx512f"))) void add_block_avx512(PhasorBlock& at, const PhasorBlock& by,
                                                         std::complex<double>* sums, std::size_t frequencies) {
  add_block(at, by, sums, frequencies);
}
__attribute__((target("avx2"))) void add_block_avx2(PhasorBlock& at, const PhasorBlock& by,
                                                    std::complex<double>* sums, std::size_t frequencies) {
  add_block(at, by, sums, frequencies);
}
#endif
void add_block_baseline(PhasorBlock& at, const PhasorBlock& by, std::complex<double>* sums,
                        std::size_t frequencies) {
  add_block(at, by, sums, frequencies);
}

AddBlock fastest_add() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") != 0) return add_block_avx512;
  if (__builtin_cpu_supports("avx2") != 0) return add_block_avx2;
#endif
  return add_block_baseline;
}
const AddBlock kAddBlock = fastest_add();

}  // namespace

void add_phasor_sums(const Eigen::ArrayXcd& at, const Eigen::ArrayXcd& by,
                     std::vector<std::complex<double>>& sums) {
  PhasorBlock points, turn;
  const auto count = static_cast<std::size_t>(at.size());
  for (std::size_t first = 0; first < count; first += kPointsTogether) {
    const std::size_t own = std::min(kPointsTogether, count - first);
    points.load(at.data() + first, own);
    turn.load(by.data() + first, own);
    kAddBlock(points, turn, sums.data(), sums.size());
  }
}

}  // namespace kilotwin::identify
