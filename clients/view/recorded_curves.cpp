#include "clients/view/recorded_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "clients/view/recently_used.hpp"
#include "clients/view/run_text.hpp"
#include "core/base/error.hpp"
#include "core/base/ids.hpp"

namespace kilotwin::view {
namespace {

using namespace std::chrono_literals;

/// Octets of the file that one curve may read, and the octets per robot of a state and of the value of a variable.
constexpr std::size_t kCurveBytes = 48'000'000, kStateBytesPerRobot = 26, kValueBytesPerRobot = 6;
/// Of a recording that grows, an answer is given again for so long.
constexpr auto kAnswerHolds = 1s;
constexpr std::size_t kMostAnswers = 64;
/// Records of events that one answer reads at most.
constexpr std::size_t kMostRecordsPerAnswer = 4000;
/// Curves of which it is remembered what was read. More than viewers that look at different robots at once, as a rule.
constexpr std::size_t kMostEventCounts = 32, kMostKnownPoints = 64;
constexpr std::int64_t kEver = std::numeric_limits<std::int64_t>::max();

struct EventPlot {
  proto::RecordedEvent kind;
  const char* name;
  const char* title;
};
constexpr std::array<EventPlot, 3> kEventPlots{{{proto::SENT, "sent", "messages sent, recorded"},
                                                {proto::RECEIVED, "received", "messages received, recorded"},
                                                {proto::FAILURE, "failures", "failures of programs"}}};

double number_in(const proto::VariableRecord& record, int i) {
  if (i < record.integer_size()) return static_cast<double>(record.integer(i));
  return i < record.number_size() ? record.number(i) : kNothing;
}

/// Further than this a robot does not drive in so many seconds: it was placed elsewhere. The page knows the same bound.
double furthest_mm(double seconds) { return 20 + 60 * seconds; }

/// Where a robot stands in a record, whose robots ascend; -1: nowhere.
int place_of(const proto::VariableRecord& record, std::uint32_t robot) {
  const auto found = std::lower_bound(record.robot().begin(), record.robot().end(), robot);
  if (found == record.robot().end() || *found != robot) return -1;
  return static_cast<int>(found - record.robot().begin());
}

}  // namespace

RecordedCurves::RecordedCurves(recorder::Reader& reader, const recorder::StateIndex& index,
                               ResidualCurves& residuals)
    : reader_(reader), index_(index), residuals_(residuals), own_variables_(reader, index) {
  const proto::RecordingHeader& header = reader_.header();
  for (std::size_t i = 0; i < recorder::kObservables.size(); ++i) {
    const recorder::ObservableInfo& info = recorder::kObservables[i];
    if (static_cast<recorder::Observable>(i) == recorder::Observable::kPushed && header.movable_size() == 0)
      continue;
    const bool of_robot = static_cast<recorder::Observable>(i) == recorder::Observable::kDisplacement;
    plots_.push_back(
        {std::string(info.name), std::string(info.title), std::string(info.unit), true, of_robot, {}, {}, {}, i});
  }
  try {
    auto own = std::make_unique<recorder::SwarmObservables>(header);
    if (own->any()) own_ = std::move(own);
  } catch (const UserError&) {
    // A recording of another version may hold expressions that this one cannot read.
  }
  for (std::size_t i = 0; own_ && i < own_->names().size(); ++i) {
    Plot& plot = plots_.emplace_back();
    plot.name = own_->names()[i];
    plot.title = fmt::format("{} (observable)", plot.name);
    plot.own = i;
  }
  constexpr std::array<std::array<const char*, 2>, kCounts> kCountNames{
      {{"running", "robots whose program runs"}, {"failed", "failed robots"}, {"lit", "robots with their LED on"}}};
  for (std::size_t i = 0; i < kCounts; ++i)
    plots_.push_back(
        {kCountNames[i][0], kCountNames[i][1], "", true, false, {}, {}, {}, recorder::kObservables.size() + i});
  for (const EventPlot& event : kEventPlots) {
    const bool recorded =
        std::find(header.event().begin(), header.event().end(), event.kind) != header.event().end();
    if (recorded || event.kind == proto::FAILURE)
      plots_.push_back(
          {event.name, event.title, "", true, true, {}, static_cast<std::uint32_t>(event.kind), {}, 0});
  }
  for (int v = 0; v < header.variable_size(); ++v) {
    const std::string& name = header.variable(v).name();
    plots_.push_back({name, name, "", true, true, static_cast<std::uint32_t>(v), {}, {}, 0});
  }
  if (residuals_.any()) {
    Plot& plot = plots_.emplace_back();
    plot.name = "residuals";
    plot.title = "residuals of the monitor, whitened";
    plot.of_robot = plot.residuals = true;
  }
}

std::string RecordedCurves::list() const {
  std::vector<PlotEntry> list;
  for (const Plot& plot : plots_)
    list.push_back({plot.name, plot.title, plot.unit, plot.of_swarm, plot.of_robot, plot.variable.has_value(), {}});
  return plots_text(list);
}

std::string RecordedCurves::plot(std::uint32_t number, std::optional<std::uint32_t> robot) {
  if (number >= plots_.size()) return {};
  const Plot& plot = plots_[number];
  if (robot && (*robot >= reader_.header().robots() || !plot.of_robot)) return {};
  const std::pair key(number, robot ? std::int64_t{*robot} : -1);
  const auto known = answers_.find(key);
  const auto now = Clock::now();
  if (known != answers_.end() &&
      ((known->second.states == index_.states().size() && known->second.ended == index_.ended()) ||
       now - known->second.made < kAnswerHolds))
    return known->second.text;
  const Curves curves = plot.variable    ? of_variable(*plot.variable, robot)
                        : plot.event     ? of_events(*plot.event, robot)
                        : plot.own       ? of_own(*plot.own)
                        : plot.residuals ? residuals_.curves(robot, kMostPoints)
                        : robot          ? of_displacement(*robot)
                                         : of_states(plot);
  std::string text = plot_text(number, robot, curves);
  if (answers_.size() >= kMostAnswers)
    answers_.erase(std::min_element(answers_.begin(), answers_.end(),
                                    [](const auto& a, const auto& b) { return a.second.made < b.second.made; }));
  if (curves.whole) answers_[key] = {text, index_.states().size(), index_.ended(), now};
  return text;
}

const proto::Record* RecordedCurves::record_at(std::uint64_t offset) {
  reader_.go_to(offset);
  return reader_.next();
}

double RecordedCurves::seconds(std::int64_t tick) const { return reader_.tick_length().seconds_at(Tick{tick}); }

/// A power of two, so that a curve that has become longer keeps every second point.
std::size_t RecordedCurves::stride(std::size_t entries, std::size_t entry_bytes) const {
  const std::size_t affordable =
      std::clamp<std::size_t>(kCurveBytes / std::max<std::size_t>(1, entry_bytes), 2, kMostPoints);
  std::size_t stride = 1;
  while (entries / stride > affordable) stride *= 2;
  return stride;
}

template <class Known, class Take>
bool RecordedCurves::each_new(Known& known, std::span<const recorder::StateIndex::Entry> all,
                              std::size_t entry_bytes, std::int64_t until_tick, const Take& take) {
  const std::size_t step = stride(all.size(), entry_bytes);
  std::erase_if(known, [step](const auto& one) { return one.first % step != 0; });
  const auto until = Clock::now() + kReadFor;
  for (std::size_t i = 0; i < all.size() && all[i].tick <= until_tick; i += step) {
    if (known.contains(i)) continue;
    take(i, all[i]);
    if (Clock::now() > until && i + step < all.size()) return false;
  }
  return true;
}

template <class Known, class Take>
bool RecordedCurves::each_new_state(Known& known, std::size_t count, std::int64_t until_tick, const Take& take) {
  return each_new(known, std::span(index_.states()).first(count), kStateBytesPerRobot * reader_.header().robots(),
                  until_tick, [this, &take](std::size_t number, const recorder::StateIndex::Entry& entry) {
                    const proto::Record* const record = record_at(entry.offset);
                    if (record != nullptr && record->has_state()) take(number, record->state());
                  });
}

RecordedCurves::Points& RecordedCurves::points_of(Curve curve, std::uint32_t variable,
                                                  std::optional<std::uint32_t> robot) {
  return recently_used(
             points_, kMostKnownPoints,
             [&](const KnownPoints& known) {
               return known.curve == curve && known.variable == variable && known.robot == robot;
             },
             KnownPoints{curve, variable, robot, {}})
      .at;
}

bool RecordedCurves::take_states() {
  return each_new_state(
      states_, index_.states().size(), kEver, [this](std::size_t number, const proto::StateRecord& state) {
        observer_.add(seconds(state.tick()), recorder::values(state.x_mm()), recorder::values(state.y_mm()),
                      recorder::values(state.heading_rad()), recorder::values(state.movable_x_mm()),
                      recorder::values(state.movable_y_mm()));
        std::array<double, kNumbers>& numbers = states_[number];
        for (std::size_t o = 0; o < recorder::kObservables.size(); ++o)
          numbers[o] = observer_.curves().value[o].back();
        const auto count = [&numbers](std::size_t place, const std::string& octets, auto holds) {
          numbers[recorder::kObservables.size() + place] = static_cast<double>(std::count_if(
              octets.begin(), octets.end(), [&](char octet) { return holds(static_cast<std::uint8_t>(octet)); }));
        };
        const auto is = [](LifeCycle wanted) {
          return [wanted](std::uint8_t life) { return life == static_cast<std::uint8_t>(wanted); };
        };
        count(0, state.life_cycle(), is(LifeCycle::kRunning));
        count(1, state.life_cycle(), is(LifeCycle::kFailed));
        count(2, state.led(), [](std::uint8_t led) { return led != 0; });
      });
}

Curves RecordedCurves::of_states(const Plot& plot) {
  Curves curves;
  curves.whole = take_states();
  curves.names = {"value"};
  curves.values.resize(1);
  for (const auto& [number, numbers] : states_) {
    curves.time_s.push_back(seconds(index_.states()[number].tick));
    curves.values[0].push_back(numbers[plot.number]);
  }
  return curves;
}

bool RecordedCurves::take_own() {
  // Values of variables at the last ticks may still come.
  std::int64_t settled = index_.states().back().tick;
  for (std::size_t v = 0; v < static_cast<std::size_t>(reader_.header().variable_size()) && !index_.ended(); ++v) {
    const std::vector<recorder::StateIndex::Entry>& all = index_.variable(v);
    settled = std::min(settled, all.empty() ? -1 : all.back().tick - kSettled_ticks);
  }
  return each_new_state(
      own_values_, index_.states().size(), settled, [this](std::size_t number, const proto::StateRecord& read) {
        const proto::StateRecord state = read;  // NOLINT: reading variables takes the reader's memory
        own_variables_.take(state.tick(), *own_);
        const double time_s = seconds(state.tick());
        own_observer_.add(time_s, recorder::values(state.x_mm()), recorder::values(state.y_mm()),
                          recorder::values(state.heading_rad()), recorder::values(state.movable_x_mm()),
                          recorder::values(state.movable_y_mm()));
        own_values_[number] = own_->values(time_s, state, own_observer_.curves());
      });
}

Curves RecordedCurves::of_own(std::size_t number) {
  Curves curves;
  curves.whole = take_own();
  curves.names = {"value"};
  curves.values.resize(1);
  for (const auto& [state, values] : own_values_) {
    curves.time_s.push_back(seconds(index_.states()[state].tick));
    curves.values[0].push_back(values[number]);
  }
  return curves;
}

bool RecordedCurves::take_places(Points& points, std::uint32_t robot, std::size_t states) {
  return each_new_state(
      points, states, kEver,
      [&points, i = static_cast<int>(robot)](std::size_t number, const proto::StateRecord& state) {
        points[number] = {state.x_mm(i), state.y_mm(i)};
      });
}

Curves RecordedCurves::of_displacement(std::uint32_t robot) {
  Points& points = points_of(Curve::kPath, 0, robot);
  Curves curves{{}, {"value"}, {{}}};
  curves.whole = take_places(points, robot, index_.states().size());
  for (const auto& [number, place] : points) {
    const std::array<double, 3>& first = points.begin()->second;
    curves.time_s.push_back(seconds(index_.states()[number].tick));
    curves.values[0].push_back(std::hypot(place[0] - first[0], place[1] - first[1]));
  }
  return curves;
}

std::string RecordedCurves::trail(std::uint32_t robot, std::int64_t tick) {
  Points& points = points_of(Curve::kTrail, 0, robot);
  const std::size_t last = index_.at_or_before(tick);
  const bool whole = take_places(points, robot, last + 1);
  // It ends at the tick, also where the curve leaves out the state there.
  if (const proto::Record* const record = record_at(index_.states()[last].offset);
      record != nullptr && record->has_state())
    points[last] = {record->state().x_mm(static_cast<int>(robot)), record->state().y_mm(static_cast<int>(robot))};
  std::vector<double> xy_mm;
  const std::array<double, 3>* before = nullptr;
  double before_s = 0;
  for (const auto& [number, place] : points) {
    if (number > last) break;
    const double time_s = seconds(index_.states()[number].tick);
    if (before != nullptr &&
        std::hypot(place[0] - (*before)[0], place[1] - (*before)[1]) > furthest_mm(time_s - before_s))
      xy_mm.insert(xy_mm.end(), {kNothing, kNothing});
    xy_mm.insert(xy_mm.end(), {place[0], place[1]});
    before = &place;
    before_s = time_s;
  }
  return trail_text(robot, xy_mm, whole);
}

/// Of a robot its value; of the swarm mean, least and largest value. `of_tick`: the variable's records of one tick.
std::array<double, 3> RecordedCurves::values_at(std::span<const recorder::StateIndex::Entry> of_tick,
                                                std::optional<std::uint32_t> robot) {
  double sum = 0, least = kNothing, largest = kNothing, value = kNothing;
  std::size_t count = 0;
  for (const recorder::StateIndex::Entry& entry : of_tick) {
    const proto::Record* const record = record_at(entry.offset);
    if (record == nullptr || !record->has_variable()) continue;
    if (robot) {
      if (const int place = place_of(record->variable(), *robot); place >= 0)
        value = number_in(record->variable(), place);
      continue;
    }
    for (int k = 0; k < record->variable().robot_size(); ++k) {
      const double one = number_in(record->variable(), k);
      if (!std::isfinite(one)) continue;
      sum += one;
      least = std::fmin(least, one);
      largest = std::fmax(largest, one);
      ++count;
    }
  }
  if (robot) return {value, kNothing, kNothing};
  return {count > 0 ? sum / static_cast<double>(count) : kNothing, least, largest};
}

Curves RecordedCurves::of_variable(std::uint32_t variable, std::optional<std::uint32_t> robot) {
  using Entry = recorder::StateIndex::Entry;
  const std::vector<Entry>& all = index_.variable(variable);
  // Records of one tick belong together: an entry's offset is the position of the first one here.
  std::vector<Entry> ticks;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i == 0 || all[i].tick != all[i - 1].tick) ticks.push_back({all[i].tick, i});
  Points& points = points_of(Curve::kVariable, variable, robot);
  Curves curves;
  curves.whole =
      each_new(points, ticks, kValueBytesPerRobot * reader_.header().robots(), kEver,
               [&](std::size_t number, const Entry& tick) {
                 const std::size_t end = number + 1 < ticks.size() ? ticks[number + 1].offset : all.size();
                 points[number] = values_at(std::span(all).subspan(tick.offset, end - tick.offset), robot);
               });
  curves.names = robot ? std::vector<std::string>{"value"} : std::vector<std::string>{"mean", "min", "max"};
  curves.values.resize(curves.names.size());
  for (const auto& [number, values] : points) {
    curves.time_s.push_back(seconds(ticks[number].tick));
    for (std::size_t i = 0; i < curves.values.size(); ++i) curves.values[i].push_back(values[i]);
  }
  // Of a recording that grows, a host's records of the last ticks may still come.
  if (!index_.ended() && !all.empty())
    std::erase_if(points,
                  [&](const auto& one) { return ticks[one.first].tick > all.back().tick - kSettled_ticks; });
  return curves;
}

RecordedCurves::EventCounts& RecordedCurves::counts_of(std::uint32_t kind, std::optional<std::uint32_t> robot) {
  return recently_used(
      event_counts_, kMostEventCounts,
      [&](const EventCounts& counts) { return counts.kind == kind && counts.robot == robot; },
      EventCounts{kind, robot, {}});
}

/// The number of events so far. Every event counts, also where the curve has fewer points.
Curves RecordedCurves::of_events(std::uint32_t kind, std::optional<std::uint32_t> robot) {
  const std::vector<recorder::StateIndex::Entry>& all = index_.events(kind);
  EventCounts& counts = counts_of(kind, robot);
  std::vector<std::uint64_t>& up_to = counts.up_to;
  Curves curves{{seconds(index_.states().front().tick)}, {"value"}, {{0}}};
  // Of a recording that grows, a host's records may still come between the last ones.
  const std::int64_t settled =
      index_.ended() || all.empty() ? std::numeric_limits<std::int64_t>::max() : all.back().tick - kSettled_ticks;
  for (std::size_t read = 0; up_to.size() < all.size() && all[up_to.size()].tick <= settled; ++read) {
    if (read == kMostRecordsPerAnswer) {
      curves.whole = false;
      break;
    }
    const proto::Record* const record = record_at(all[up_to.size()].offset);
    std::uint64_t count = up_to.empty() ? 0 : up_to.back();
    if (record != nullptr && record->has_event()) {
      const auto& robots = record->event().robot();
      count += static_cast<std::uint64_t>(robot ? std::count(robots.begin(), robots.end(), *robot) : robots.size());
    }
    up_to.push_back(count);
  }
  const std::size_t step = up_to.size() / kMostPoints + 1;
  const auto add = [&curves](double time_s, std::uint64_t count) {
    curves.time_s.push_back(time_s);
    curves.values[0].push_back(static_cast<double>(count));
  };
  for (std::size_t i = step - 1; i < up_to.size(); i += step) add(seconds(all[i].tick), up_to[i]);
  if (!curves.whole || up_to.empty()) return curves;
  const double end = seconds(std::max(index_.states().back().tick, all[up_to.size() - 1].tick));
  if (curves.time_s.back() < end)
    add(end, up_to.back());
  else
    curves.values[0].back() = static_cast<double>(up_to.back());
  return curves;
}

std::optional<double> RecordedCurves::value(std::uint32_t variable, std::uint32_t robot, std::int64_t tick) {
  // As many records as hosts may have one tick; a robot that is absent has no value.
  constexpr int kMostRecords = 64;
  const std::vector<recorder::StateIndex::Entry>& all = index_.variable(variable);
  auto at = std::upper_bound(all.begin(), all.end(), tick,
                             [](std::int64_t wanted, const auto& entry) { return wanted < entry.tick; });
  for (int tries = 0; at != all.begin() && tries < kMostRecords; ++tries) {
    --at;
    const proto::Record* const record = record_at(at->offset);
    if (record == nullptr || !record->has_variable()) continue;
    if (const int place = place_of(record->variable(), robot); place >= 0)
      return number_in(record->variable(), place);
  }
  return std::nullopt;
}

}  // namespace kilotwin::view
