#include "clients/identify/radio/link_intervals.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::radio_fit {
namespace {

struct Number {
  const char* name;
  const char* unit;
  double LinkModel::*value;
  Terms since;  ///< the first model that has it
};
constexpr std::array kNumbers = {
    Number{"range", "mm", &LinkModel::range_mm, Terms::kDistance},
    Number{"loss by a body in between", "dB", &LinkModel::body_loss_db, Terms::kBodies},
    Number{"sd of power over robots", "dB", &LinkModel::power_sd_db, Terms::kRobots},
    Number{"sd of sensitivity over robots", "dB", &LinkModel::sensitivity_sd_db, Terms::kRobots},
    Number{"sd of power by bearing", "dB", &LinkModel::power_bearing_sd_db, Terms::kBearings},
    Number{"sd of sensitivity by bearing", "dB", &LinkModel::sensitivity_bearing_sd_db, Terms::kBearings},
    Number{"sd of pairs", "dB", &LinkModel::pair_sd_db, Terms::kPairs},
    Number{"sd of links", "dB", &LinkModel::link_sd_db, Terms::kPairs},
};

/// The sets without what a robot sent or received.
std::vector<GridSet> without(std::vector<GridSet> sets, Eigen::Index robot) {
  for (GridSet& set : sets) {
    for (GridRun& run : set.runs) {
      run.counts.row(robot).setConstant(-1);
      run.counts.col(robot).setConstant(-1);
    }
  }
  return sets;
}

}  // namespace

std::vector<identification::Estimate> numbers_of(const LinkModel& fitted, const std::vector<GridSet>& sets,
                                                 std::uint32_t threads) {
  const auto robots = static_cast<std::size_t>(sets.front().robots());
  const auto count = static_cast<double>(robots);
  std::vector<LinkModel> left(robots);
  os::in_parallel(robots, threads, [&](std::size_t r) {
    left[r] = fit_links(without(sets, static_cast<Eigen::Index>(r)), fitted.terms);
  });
  const double t95 = stats::student_quantile(0.975, count - 1);
  std::vector<identification::Estimate> out;
  for (const Number& number : kNumbers) {
    if (fitted.terms < number.since) continue;
    double mean = 0, squares = 0;
    for (const LinkModel& model : left) mean += model.*number.value / count;
    for (const LinkModel& model : left) squares += std::pow(model.*number.value - mean, 2);
    const double half = t95 * std::sqrt((count - 1) / count * squares), value = fitted.*number.value;
    identification::Estimate& one = out.emplace_back();
    one.set_name(number.name);
    one.set_unit(number.unit);
    one.set_value(value);
    one.set_low(number.value == &LinkModel::range_mm ? value - half : std::max(0.0, value - half));
    one.set_high(value + half);
    one.set_how("jackknife over robots");
  }
  if (fitted.terms >= Terms::kPlacement) {
    identification::Estimate& laying = out.emplace_back();
    laying.set_name("sd of the pattern over placements");
    laying.set_unit("dB");
    laying.set_value(fitted.laying_sd_db);
    laying.set_how("no interval: each set is one placement, and there are few");
  }
  return out;
}

}  // namespace kilotwin::radio_fit
