#include "clients/identify/radio/grid_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/csv/csv_reader.hpp"

namespace kilotwin::radio_fit {
namespace {

namespace fs = std::filesystem;

/// Pitches of the known sets: robots in contact without pauses (33 mm), else 50 mm. With these, reception ends at
/// the same distance, 130..150 mm.
constexpr double kTouchingPitch_mm = 2 * kRobotRadius_mm, kPitch_mm = 50;
constexpr int kMostRobots = 1000;

GridRun read_run(const fs::path& file) {
  CsvReader counts(file, {' ', false, false});
  GridRun run;
  run.name = file.stem().string();
  std::vector<std::vector<double>> rows;
  while (counts.next()) {
    std::vector<double>& row = rows.emplace_back();
    for (std::size_t i = 0; i < counts.cells(); ++i) {
      row.push_back(counts.number(i));
      if (row.back() < 0 || row.back() > 1e9)
        counts.complain(i, fmt::format("\"{}\" is no count; give 0..1e9", counts.text(i)));
    }
  }
  std::size_t width = 0;
  for (const auto& row : rows) width = std::max(width, row.size());
  // If rows have one number more than the swarm (a square number), the first is the receiver's id.
  const auto square = [](std::size_t n) {
    const auto side = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(n))));
    return side * side == n;
  };
  const bool ids = !square(width) && width > 1 && square(width - 1);
  const std::size_t robots = ids ? width - 1 : width;
  if (robots < 4 || robots > kMostRobots || !square(robots))
    throw UserError(
        fmt::format("{}: rows of {} columns; expected those of a square grid of robots", file.string(), width));
  const auto n = static_cast<Eigen::Index>(robots);
  run.counts = Eigen::MatrixXd::Constant(n, n, -1);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].size() != width) continue;  // a truncated line
    const auto receiver = ids ? static_cast<Eigen::Index>(rows[r][0]) : static_cast<Eigen::Index>(r);
    if (receiver >= n) continue;
    for (Eigen::Index j = 0; j < n; ++j)
      run.counts(receiver, j) = rows[r][static_cast<std::size_t>(j) + (ids ? 1 : 0)];
  }
  return run;
}

}  // namespace

double GridRun::share(Eigen::Index i, Eigen::Index j) const {
  if (counts(i, j) < 0 || !(counts(j, j) > 0)) return -1;
  return std::min(1.0, counts(i, j) / counts(j, j));
}

int GridSet::side() const { return static_cast<int>(std::lround(std::sqrt(robots()))); }

Eigen::Vector2d GridSet::place_mm(int robot) const {
  return {pitch_mm * (robot % side()), -pitch_mm * (robot / side())};
}

Eigen::VectorXd mean_sent(const GridSet& set) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(set.robots()), runs = sum;
  for (const GridRun& run : set.runs) {
    for (Eigen::Index i = 0; i < sum.size(); ++i) {
      if (run.sent(i) < 0) continue;
      sum(i) += run.sent(i);
      runs(i) += 1;
    }
  }
  return sum.cwiseQuotient(runs.cwiseMax(1));
}

std::vector<GridSet> read_grids(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(directory, error)) files.push_back(entry.path());
  if (error)
    throw UserError(fmt::format("{}: cannot be read ({}); give a directory with comm_tau*_run*.dat",
                                directory.string(), error.message()));
  std::sort(files.begin(), files.end());
  std::map<double, GridSet> sets;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    const std::size_t end = name.find("_run");
    if (!name.starts_with("comm_tau") || end == std::string::npos || !name.ends_with(".dat")) continue;
    const std::string tau = name.substr(8, end - 8);
    double tau_s = 0;
    if (std::from_chars(tau.data(), tau.data() + tau.size(), tau_s).ec != std::errc{}) continue;
    GridSet& set = sets[tau_s];
    set.name = "tau" + tau;
    set.tau_s = tau_s;
    set.pitch_mm = tau_s == 0 ? kTouchingPitch_mm : kPitch_mm;
    set.runs.push_back(read_run(file));
    if (set.runs.back().counts.rows() != set.runs.front().counts.rows())
      throw UserError(fmt::format("{}: another number of robots than in {}", file.string(), set.runs.front().name));
  }
  if (sets.empty())
    throw UserError(fmt::format("{}: no runs; expected files comm_tau*_run*.dat", directory.string()));
  std::vector<GridSet> result;
  for (auto& [tau_s, set] : sets) result.push_back(std::move(set));
  return result;
}

std::vector<GridSet> half_of(const std::vector<GridSet>& sets, bool odd) {
  std::vector<GridSet> result = sets;
  for (GridSet& set : result) {
    std::vector<GridRun> runs;
    for (std::size_t i = odd ? 1 : 0; i < set.runs.size(); i += 2) runs.push_back(std::move(set.runs[i]));
    set.runs = std::move(runs);
  }
  return result;
}

}  // namespace kilotwin::radio_fit
