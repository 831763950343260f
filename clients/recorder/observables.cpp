#include "clients/recorder/observables.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "clients/recorder/export.hpp"
#include "clients/recorder/ordered_records.hpp"
#include "clients/recorder/swarm_observables.hpp"
#include "clients/recorder/variables_until.hpp"
#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "core/stats/moments.hpp"

namespace kilotwin::recorder {

double mean_nearest_distance_mm(std::span<const double> x_mm, std::span<const double> y_mm) {
  const std::size_t robots = x_mm.size();
  if (robots < 2) return std::numeric_limits<double>::quiet_NaN();
  const auto [low_x, high_x] = std::minmax_element(x_mm.begin(), x_mm.end());
  const auto [low_y, high_y] = std::minmax_element(y_mm.begin(), y_mm.end());
  // Robots in columns, sorted by y. A column is about as wide as the mean distance of neighbours.
  const double width_mm = *high_x - *low_x, height_mm = *high_y - *low_y;
  const auto count = static_cast<double>(robots);
  const double column_mm = std::max({std::sqrt(width_mm * height_mm / count), width_mm / count, 1e-6});
  const double from_x_mm = *low_x;
  const auto column_of = [&](double x) { return static_cast<std::size_t>((x - from_x_mm) / column_mm); };
  const std::size_t columns = column_of(*high_x) + 1;
  std::vector<std::size_t> first(columns + 1, 0), order(robots);
  for (const double x : x_mm) ++first[column_of(x) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const std::size_t column_a = column_of(x_mm[a]), column_b = column_of(x_mm[b]);
    return column_a != column_b ? column_a < column_b : y_mm[a] != y_mm[b] ? y_mm[a] < y_mm[b] : a < b;
  });

  stats::Moments nearest;
  for (std::size_t robot = 0; robot < robots; ++robot) {
    double best = std::numeric_limits<double>::infinity();  // squared
    const double x = x_mm[robot], y = y_mm[robot];
    const auto look_at = [&](std::size_t other) {
      const double dx = x_mm[other] - x, dy = y_mm[other] - y;
      if (other != robot) best = std::min(best, dx * dx + dy * dy);
      return dy * dy <= best;
    };
    const auto search = [&](std::size_t column) {
      const auto begin = order.begin() + static_cast<std::ptrdiff_t>(first[column]);
      const auto end = order.begin() + static_cast<std::ptrdiff_t>(first[column + 1]);
      const auto middle =
          std::lower_bound(begin, end, y, [&](std::size_t other, double at) { return y_mm[other] < at; });
      for (auto up = middle; up != end && look_at(*up); ++up) {}
      for (auto down = middle; down != begin && look_at(*(down - 1)); --down) {}
    };
    const std::size_t own = column_of(x);
    search(own);
    for (std::size_t away = 1; away < columns; ++away) {
      const double gap_mm = static_cast<double>(away - 1) * column_mm;
      if (gap_mm * gap_mm > best) break;
      if (own >= away) search(own - away);
      if (own + away < columns) search(own + away);
    }
    nearest.add(std::sqrt(best));
  }
  return nearest.mean();
}

void ObservableObserver::add(double time_s, std::span<const double> x_mm, std::span<const double> y_mm,
                             std::span<const double> heading_rad, std::span<const double> movable_x_mm,
                             std::span<const double> movable_y_mm) {
  if (curves_.time_s.empty()) {
    start_x_mm_.assign(x_mm.begin(), x_mm.end());
    start_y_mm_.assign(y_mm.begin(), y_mm.end());
    movable_start_x_mm_.assign(movable_x_mm.begin(), movable_x_mm.end());
    movable_start_y_mm_.assign(movable_y_mm.begin(), movable_y_mm.end());
  }
  const std::size_t robots = start_x_mm_.size();
  KILOTWIN_DEMAND(x_mm.size() == robots && y_mm.size() == robots && heading_rad.size() == robots);
  stats::Moments square, distance, x, y, cosine, sine;
  for (std::size_t i = 0; i < robots; ++i) {
    const double dx = x_mm[i] - start_x_mm_[i], dy = y_mm[i] - start_y_mm_[i];
    square.add(dx * dx + dy * dy);
    distance.add(std::sqrt(dx * dx + dy * dy));
    x.add(x_mm[i]);
    y.add(y_mm[i]);
    double c = 0, s = 0;
    kt_sincos(heading_rad[i], &s, &c);
    cosine.add(c);
    sine.add(s);
  }
  stats::Moments from_centroid;
  for (std::size_t i = 0; i < robots; ++i) {
    const double dx = x_mm[i] - x.mean(), dy = y_mm[i] - y.mean();
    from_centroid.add(dx * dx + dy * dy);
  }
  stats::Moments pushed;
  KILOTWIN_DEMAND(movable_x_mm.size() == movable_start_x_mm_.size() && movable_y_mm.size() == movable_x_mm.size());
  for (std::size_t i = 0; i < movable_x_mm.size(); ++i) {
    const double dx = movable_x_mm[i] - movable_start_x_mm_[i], dy = movable_y_mm[i] - movable_start_y_mm_[i];
    pushed.add(std::sqrt(dx * dx + dy * dy));
  }
  curves_.time_s.push_back(time_s);
  const auto put = [this](Observable o, double value) {
    curves_.value[static_cast<std::size_t>(o)].push_back(value);
  };
  put(Observable::kMsd, square.mean());
  put(Observable::kDisplacement, distance.mean());
  put(Observable::kSpread, std::sqrt(from_centroid.mean()));
  put(Observable::kNearest, mean_nearest_distance_mm(x_mm, y_mm));
  put(Observable::kPolarisation, std::sqrt(cosine.mean() * cosine.mean() + sine.mean() * sine.mean()));
  put(Observable::kPushed, pushed.count() > 0 ? pushed.mean() : std::numeric_limits<double>::quiet_NaN());
}

namespace {

/// Observes all robots, or one group.
class RobotsObserver {
 public:
  /// `only`: a group; nothing: all robots.
  RobotsObserver(const proto::RecordingHeader& header, std::optional<std::uint32_t> only) : own_(header, only) {
    // Robots of a group are neighbours in every column.
    const std::vector<std::uint32_t> groups = groups_of(header);
    const auto [begin, end] =
        only ? std::equal_range(groups.begin(), groups.end(), *only) : std::pair(groups.begin(), groups.end());
    first_ = static_cast<std::size_t>(begin - groups.begin());
    count_ = static_cast<std::size_t>(end - begin);
    for (const std::string& name : own_.names()) curves_.push_back({name, {}});
  }
  [[nodiscard]] bool takes_variables() const { return own_.any(); }
  void take(const proto::VariableRecord& variable) { own_.take(variable); }
  [[nodiscard]] SwarmObservables& own() { return own_; }
  void take(double time_s, const proto::StateRecord& state) {
    const auto column = [&](const auto& field) { return values(field).subspan(first_, count_); };
    observer_.add(time_s, column(state.x_mm()), column(state.y_mm()), column(state.heading_rad()),
                  values(state.movable_x_mm()), values(state.movable_y_mm()));
    if (!own_.any()) return;
    const std::vector<double> at = own_.values(time_s, state, observer_.curves());
    for (std::size_t i = 0; i < curves_.size(); ++i) curves_[i].value.push_back(at[i]);
  }
  [[nodiscard]] ObservableCurves curves() {
    ObservableCurves all = observer_.curves();
    all.own = std::move(curves_);
    return all;
  }

 private:
  std::size_t first_ = 0, count_ = 0;
  ObservableObserver observer_;
  SwarmObservables own_;
  std::vector<OwnCurve> curves_;
};

/// Reads the recording once for all observers.
std::vector<ObservableCurves> observe(Reader& recording, std::vector<RobotsObserver> observers) {
  const bool variables = observers.front().takes_variables();
  OrderedRecords ordered(recording, OrderedRecords::kStates | (variables ? OrderedRecords::kVariables : 0u));
  while (ordered.next()) {
    const double time_s = recording.tick_length().seconds_at(ordered.tick());
    for (RobotsObserver& observer : observers) {
      for (const proto::VariableRecord& variable : ordered.records().variables) observer.take(variable);
      if (ordered.records().state) observer.take(time_s, *ordered.records().state);
    }
  }
  std::vector<ObservableCurves> curves;
  curves.reserve(observers.size());
  for (RobotsObserver& observer : observers) curves.push_back(observer.curves());
  return curves;
}

}  // namespace

ObservableCurves observe(Reader& recording) {
  std::vector<RobotsObserver> all;
  all.emplace_back(recording.header(), std::nullopt);
  return std::move(observe(recording, std::move(all)).front());
}

ObservableCurves observe_every(Reader& recording, const StateIndex& index, std::size_t step) {
  RobotsObserver all(recording.header(), std::nullopt);
  VariablesUntil variables(recording, index);
  const std::vector<StateIndex::Entry>& states = index.states();
  for (std::size_t i = 0; i < states.size();
       i = i + 1 == states.size() ? i + 1 : std::min(i + step, states.size() - 1)) {
    if (all.takes_variables()) variables.take(states[i].tick, all.own());
    recording.go_to(states[i].offset);
    const proto::Record* const record = recording.next();
    if (record == nullptr || !record->has_state()) continue;
    all.take(recording.tick_length().seconds_at(Tick{record->state().tick()}), record->state());
  }
  return all.curves();
}

std::vector<ObservableCurves> observe_with_groups(Reader& recording) {
  std::vector<RobotsObserver> observers;
  observers.emplace_back(recording.header(), std::nullopt);
  const int groups = std::max(1, recording.header().group_robots_size());
  for (int group = 0; group < groups; ++group)
    observers.emplace_back(recording.header(), static_cast<std::uint32_t>(group));
  return observe(recording, std::move(observers));
}

}  // namespace kilotwin::recorder
