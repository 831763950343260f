/// Mean square displacements of ARGoS with its Kilobot plugin, which the ARGoS paper (Pinciroli et al., ANTS 2018) validated on
/// real robots: ARGoS 421bd763, plugin 381db2a, dynamics2d, 31 ticks per second, bias N(0.015, 1.86) mm/s, f = 1. The runs were
/// made for this project.
#pragma once

#include <array>

namespace kilotwin::validation {

struct ReferencePoint {
  double time_s, value, error;  ///< error: standard error
};

/// nom10_noise: 1000 robots at 10 mm/s far apart, displacement of the disc's centre, mm^2.
inline constexpr std::array<ReferencePoint, 6> kStraightNoise = {{{10, 9259.71, 82.89},
                                                                  {20, 30639.34, 427.34},
                                                                  {30, 55735.53, 1106.56},
                                                                  {40, 81281.41, 2065.38},
                                                                  {50, 106696.22, 3251.44},
                                                                  {60, 132269.16, 4632.62}}};
/// By how much its noise-free robots, which moved by sqrt(9897.64) mm in 10 s, lag behind 10 mm/s.
inline constexpr double kStraightLag_s = 10 - 9.94869;

/// argos_nom_noise_ring: 50 robots in four rings, 100 seeds, mm^2.
inline constexpr std::array<ReferencePoint, 4> kDiffusionRing = {
    {{10, 915.0, 33.1}, {60, 34273.4, 585.6}, {120, 90540.9, 1566.0}, {180, 147225.5, 2355.8}}};
/// argos_nom_noise_far: the same robots 5 m apart, 20 seeds, mm^2.
inline constexpr std::array<ReferencePoint, 4> kDiffusionFar = {
    {{10, 9338.8, 76.1}, {60, 68127.9, 2005.6}, {120, 128510.5, 3029.5}, {180, 191738.9, 5556.8}}};

}  // namespace kilotwin::validation
