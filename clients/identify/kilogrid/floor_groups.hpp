/// Definition of the statistics: the bins of each group, in order.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "clients/identify/kilogrid/floor_statistics.hpp"
#include "clients/identify/kilogrid/floor_swarm.hpp"

namespace kilotwin::kilogrid::groups {

/// Bins of the statistics: numbers of parts, or lower edges; lags, runs and stays in blocks. More bins show finer
/// differences, from fewer blocks each.
inline constexpr std::size_t kTimeBins = 16, kMiddleBins = 8;
inline constexpr std::array kSteps_mm = {0.,  8.,  16., 24.,  32.,  40.,  50., 60.,
                                         70., 80., 90., 100., 110., 120., 150.};
inline constexpr std::array kLags = {1, 2, 5, 10, 20, 30, 60};
inline constexpr std::array kWalls_mm = {0., 40., 50., 60., 75., 100., 150., 200., 300.};
inline constexpr std::size_t kRings = 10, kTurns = 8, kSectors = 8, kNeighbours = 5;
inline constexpr std::array kOpenRuns = {1, 2, 3, 4};
inline constexpr std::array kWallRuns = {1, 2, 3, 4, 6, 9, 12};
inline constexpr std::array kStays = {1, 2, 3, 5, 10, 20, 40, 80};
inline constexpr std::size_t kColumns = 4, kRows = 8;
inline constexpr std::size_t kAcross = 10, kToMiddle = 5;
inline constexpr std::size_t kWay = 10;  ///< lag in blocks for motion towards the middle
inline constexpr std::array kLasting = {1, 2, 5, 10, 20, 60};

/// Typical displacement per block, about which squares and products of steps are taken. Variances from
/// their means (floor_plots.cpp) need the same value.
inline constexpr double kAboutSpeed_mm = 75;

/// Lags in blocks as seconds.
template <std::size_t N> constexpr std::array<int, N> in_seconds(const std::array<int, N>& blocks) {
  std::array<int, N> lags_s{};
  for (std::size_t i = 0; i < N; ++i) lags_s[i] = blocks[i] * static_cast<int>(FloorBlocks::kBlock_s);
  return lags_s;
}
inline constexpr std::array kLags_s = in_seconds(kLags);

/// Bin edges of a track window feature (the first bin is open below), and location and scale for products of
/// features.
struct FeatureScale {
  std::vector<double> edges;
  double middle, width;
};
/// In the order of feature_names().
extern const std::array<FeatureScale, 12> kFeatures;

enum Group : std::size_t {
  kStep,
  kMsd,
  kWall,
  kRing,
  kTime,
  kTurn,
  kBias,
  kSpeed,
  kStillOpen,
  kStillWall,
  kCrowd,
  kDirection,
  kPlace,
  kBoundary,
  kDrift,
  kReports,
  kStay,
  kMiddle,
  kExtent,
  kShareX,
  kShareY,
  kInwardX,
  kInwardY,
  kSpeedLasts,
  kTurnLasts,
  kWindows,  ///< first of one group per feature
  kPairs = kWindows + 12,
};

}  // namespace kilotwin::kilogrid::groups
