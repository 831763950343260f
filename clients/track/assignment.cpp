#include "clients/track/assignment.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

namespace kilotwin::track {
namespace {

/// The Hungarian method with potentials, O(rows^2 columns): per row the column of the assignment with the least total cost.
/// There are at least as many columns as rows.
std::vector<std::size_t> hungarian(const std::vector<std::vector<double>>& cost) {
  const std::size_t rows = cost.size(), columns = cost.front().size();
  std::vector<double> row_potential(rows + 1, 0), column_potential(columns + 1, 0);
  std::vector<std::size_t> row_of(columns + 1, 0), way(columns + 1, 0);  // 0: none; all others count from 1
  for (std::size_t row = 1; row <= rows; ++row) {
    row_of[0] = row;
    std::size_t column = 0;
    std::vector<double> least(columns + 1, std::numeric_limits<double>::infinity());
    std::vector<bool> used(columns + 1, false);
    do {
      used[column] = true;
      const std::size_t from = row_of[column];
      double step = std::numeric_limits<double>::infinity();
      std::size_t next = 0;
      for (std::size_t to = 1; to <= columns; ++to) {
        if (used[to]) continue;
        const double reduced = cost[from - 1][to - 1] - row_potential[from] - column_potential[to];
        if (reduced < least[to]) {
          least[to] = reduced;
          way[to] = column;
        }
        if (least[to] < step) {
          step = least[to];
          next = to;
        }
      }
      for (std::size_t to = 0; to <= columns; ++to) {
        if (used[to]) {
          row_potential[row_of[to]] += step;
          column_potential[to] -= step;
        } else {
          least[to] -= step;
        }
      }
      column = next;
    } while (row_of[column] != 0);
    while (column != 0) {
      row_of[column] = row_of[way[column]];
      column = way[column];
    }
  }
  std::vector<std::size_t> column_of(rows, 0);
  for (std::size_t column = 1; column <= columns; ++column) {
    if (row_of[column] != 0) column_of[row_of[column] - 1] = column - 1;
  }
  return column_of;
}

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t node) {
  while (parent[node] != node) node = parent[node] = parent[parent[node]];
  return node;
}

/// Solves one group of tracks and measurements that pairs connect.
void solve_group(const std::vector<Pair>& pairs, double alone, Assignment& result) {
  std::vector<std::size_t> tracks, measurements;
  for (const Pair& pair : pairs) {
    tracks.push_back(pair.track);
    measurements.push_back(pair.measurement);
  }
  const auto make_unique = [](std::vector<std::size_t>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
  };
  make_unique(tracks);
  make_unique(measurements);
  // Each track has a column of its own for "no measurement".
  constexpr double kImpossible = 1e9;
  std::vector<std::vector<double>> cost(tracks.size(),
                                        std::vector<double>(measurements.size() + tracks.size(), kImpossible));
  const auto index = [](const std::vector<std::size_t>& values, std::size_t value) {
    return static_cast<std::size_t>(std::lower_bound(values.begin(), values.end(), value) - values.begin());
  };
  for (const Pair& pair : pairs) cost[index(tracks, pair.track)][index(measurements, pair.measurement)] = pair.cost;
  for (std::size_t i = 0; i < tracks.size(); ++i) cost[i][measurements.size() + i] = alone;
  const std::vector<std::size_t> column_of = hungarian(cost);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (column_of[i] < measurements.size()) result.of_track[tracks[i]] = measurements[column_of[i]];
  }
}

}  // namespace

Assignment assign(std::size_t tracks, std::size_t measurements, const std::vector<Pair>& pairs, double alone,
                  double margin) {
  Assignment result{std::vector<std::optional<std::size_t>>(tracks), std::vector<bool>(tracks, false)};
  std::vector<std::size_t> parent(tracks + measurements);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  for (const Pair& pair : pairs) parent[root_of(parent, pair.track)] = root_of(parent, tracks + pair.measurement);
  std::map<std::size_t, std::vector<Pair>> groups;
  for (const Pair& pair : pairs) groups[root_of(parent, pair.track)].push_back(pair);
  std::map<std::pair<std::size_t, std::size_t>, double> cost;
  for (const Pair& pair : pairs) cost[{pair.track, pair.measurement}] = pair.cost;
  for (auto& [root, group] : groups) {
    solve_group(group, alone, result);
    // Two tracks are ambiguous where the exchange of their measurements costs hardly more.
    for (const Pair& pair : group) {
      const std::size_t a = pair.track;
      const std::optional<std::size_t> own = result.of_track[a];
      if (!own || *own == pair.measurement) continue;
      for (std::size_t b = 0; b < tracks; ++b) {
        if (result.of_track[b] != pair.measurement) continue;
        const auto back = cost.find({b, *own});
        if (back == cost.end()) continue;
        const double as_is = cost.at({a, *own}) + cost.at({b, pair.measurement});
        if (pair.cost + back->second - as_is < margin) result.ambiguous[a] = result.ambiguous[b] = true;
      }
    }
  }
  return result;
}

}  // namespace kilotwin::track
