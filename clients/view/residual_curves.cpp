#include "clients/view/residual_curves.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>

namespace kilotwin::view {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kColumns = 9;  // as clients/monitor/residuals.cpp writes them

/// NaN where a column is empty or no number.
std::array<double, kColumns> numbers_of(const std::string& row) {
  std::array<double, kColumns> numbers;
  numbers.fill(kNothing);
  const char* at = row.data();
  const char* const end = row.data() + row.size();
  for (double& number : numbers) {
    at = std::from_chars(at, end, number).ptr;
    if (at == end || *at != ',') break;
    ++at;
  }
  return numbers;
}

}  // namespace

ResidualCurves::ResidualCurves(const std::filesystem::path& directory) {
  if (directory.empty()) return;
  for (const char* const name : {"residuals.csv", "residuals-replayed.csv"}) {
    file_.open(directory / name);
    if (file_.is_open()) return;
  }
}

void ResidualCurves::Sums::add(const Sums& other) {
  samples += other.samples;
  headings += other.headings;
  along += other.along;
  across += other.across;
  heading += other.heading;
  squares += other.squares;
}

void ResidualCurves::take(const std::string& row) {
  const auto [time_s, robot, samples, headings, tested, along, across, heading, mean_square] = numbers_of(row);
  // The header, or a damaged row.
  if (!(time_s >= 0 && time_s < 1e12 && robot >= 0 && robot < 1e9 && samples > 0 && std::isfinite(mean_square)))
    return;
  const Sums sums{samples,
                  headings,
                  along * std::sqrt(samples),
                  across * std::sqrt(samples),
                  headings > 0 ? heading * std::sqrt(headings) : 0,
                  mean_square * (2 * samples + headings)};
  const auto second = static_cast<std::int64_t>(time_s);
  swarm_[second].add(sums);
  robots_[static_cast<std::uint32_t>(robot)][second].add(sums);
}

bool ResidualCurves::read_on() {
  const auto until = Clock::now() + kReadFor;
  file_.clear();
  std::string line;
  for (std::size_t rows = 1; std::getline(file_, line); ++rows) {
    part_ += line;
    if (file_.eof()) break;  // the row has no end yet
    take(part_);
    part_.clear();
    if (rows % 256 == 0 && Clock::now() > until) return false;
  }
  return true;
}

Curves ResidualCurves::curves(std::optional<std::uint32_t> robot, std::size_t most) {
  Curves curves;
  curves.whole = read_on();
  curves.names = robot ? std::vector<std::string>{"along", "across", "heading"}
                       : std::vector<std::string>{"mean square of all"};
  curves.values.resize(curves.names.size());
  const std::map<std::int64_t, Sums>& seconds = robot ? robots_[*robot] : swarm_;
  // A power of two, so that a curve that has become longer keeps its points.
  std::int64_t step = 1;
  while (!seconds.empty() &&
         (seconds.rbegin()->first - seconds.begin()->first) / step >= static_cast<std::int64_t>(most))
    step *= 2;
  for (auto at = seconds.begin(); at != seconds.end();) {
    const std::int64_t block = at->first / step;
    std::int64_t last = 0;
    Sums sums;
    for (; at != seconds.end() && at->first / step == block; ++at) {
      sums.add(at->second);
      last = at->first;
    }
    curves.time_s.push_back(static_cast<double>(last));
    if (!robot) {
      curves.values[0].push_back(sums.squares / (2 * sums.samples + sums.headings));
      continue;
    }
    curves.values[0].push_back(sums.along / std::sqrt(sums.samples));
    curves.values[1].push_back(sums.across / std::sqrt(sums.samples));
    curves.values[2].push_back(sums.headings > 0 ? sums.heading / std::sqrt(sums.headings) : kNothing);
  }
  return curves;
}

}  // namespace kilotwin::view
