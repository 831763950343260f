#include "clients/identify/search/hypotheses.hpp"

#include <algorithm>

#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {

Extent extent_of(const PreparedSet& set) {
  Extent e;
  std::vector<double> xs, ys;
  e.duration_s = e.motor_s = e.driven_s = e.since_s = 1;
  for (const TrackView& view : set.views()) {
    const std::vector<Sample>& samples = view.track->samples;
    const std::size_t stride = std::max<std::size_t>(1, samples.size() / 200);
    for (std::size_t i = 0; i < samples.size(); i += stride) {
      xs.push_back(samples[i].x_mm);
      ys.push_back(samples[i].y_mm);
    }
    // A run that is held out whole has no value of its own: it is unknown, not zero.
    if (!view.track->held_out && std::find(e.runs.begin(), e.runs.end(), view.number) == e.runs.end())
      e.runs.push_back(view.number);
    const double end_s = samples.back().time_s;
    const CommandState last = view.clock->at(end_s);
    e.duration_s = std::max(e.duration_s, end_s);
    e.motor_s = std::max({e.motor_s, last.motor_s[0], last.motor_s[1]});
    e.driven_s = std::max(e.driven_s, last.driven_s);
    e.sum_s = std::max(e.sum_s, last.motor_s[0] + last.motor_s[1]);
    e.commands = std::max(e.commands, last.count);
    const auto note = [&](const CommandState& state) {
      e.since_rest_s = std::max(e.since_rest_s, state.since_rest_s);
      e.difference_s = std::max(e.difference_s, std::abs(state.motor_s[1] - state.motor_s[0]));
    };
    note(last);
    for (const CommandChange& change : view.track->commands) {
      // At the end of the previous command.
      note(view.clock->at(std::nextafter(change.time_s, -1.0)));
      e.has_stop = e.has_stop || (change.motion == Motion::kStop && change.time_s > 0);
      e.has_straight = e.has_straight || change.motion == Motion::kStraight;
      e.has_turns = e.has_turns || change.motion == Motion::kLeft || change.motion == Motion::kRight;
    }
  }
  const auto bounds = [](std::vector<double>& all, double& low, double& high) {
    std::sort(all.begin(), all.end());
    low = all[all.size() / 500];
    high = all[all.size() - 1 - all.size() / 500];
    const double margin = std::max(10.0, 0.02 * (high - low));
    low -= margin;
    high += margin;
  };
  bounds(xs, e.x_low_mm, e.x_high_mm);
  bounds(ys, e.y_low_mm, e.y_high_mm);
  e.since_s = std::min(20.0, e.duration_s);
  for (const Run& run : set.set().runs) e.neighbours = e.neighbours || run.tracks.size() > 1;
  e.headings = set.set().has_headings;
  e.robots = set.set().robots();
  return e;
}

Dictionary dictionary_of(const Extent& extent, const std::vector<Term>& found) {
  Dictionary dictionary;
  DictionaryBuilder make(dictionary);
  const auto drift_in_time = add_time_hypotheses(make, extent);
  add_motor_time_hypotheses(make, extent);
  const auto drift_in_place = add_place_hypotheses(make, extent);
  add_heading_hypotheses(make, extent);
  add_wheel_hypotheses(make, extent);
  add_drift_hypotheses(make, extent, drift_in_time, drift_in_place);
  add_command_hypotheses(make, extent);
  add_neighbour_hypotheses(make, extent);
  add_some_neighbours_hypotheses(make, extent);
  add_history_hypotheses(make, extent);
  add_inertia_hypotheses(make, extent);
  add_traffic_hypotheses(make);
  add_discounted_motor_time_hypotheses(make, extent);
  add_robot_hypotheses(make, extent);
  add_run_hypotheses(make, extent);
  add_amplitude_hypotheses(make, extent, found);
  make.finish();
  return dictionary;
}

Term Dictionary::term_of(const Hypothesis& hypothesis, double relative_scale) const {
  Term term;
  term.name = hypothesis.name;
  std::vector<double> precision;
  Eigen::Index first = 0;
  std::size_t next = 0;
  for (const Block& block : blocks) {
    const auto n = static_cast<Eigen::Index>(block.basis.size());
    std::vector<std::uint32_t> own;
    while (next < hypothesis.columns.size() && hypothesis.columns[next] < first + n) {
      const Eigen::Index column = hypothesis.columns[next++];
      own.push_back(static_cast<std::uint32_t>(column - first));
      const double sd = relative_scale * scale[column];
      precision.push_back(1 / (sd * sd));
    }
    first += n;
    if (own.empty()) continue;
    Block part = block;
    if (own.size() < static_cast<std::size_t>(n)) part.basis.chosen = own;
    term.blocks.push_back(std::move(part));
  }
  term.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), static_cast<Eigen::Index>(precision.size()));
  term.coefficients = Eigen::VectorXd::Zero(term.precision.size());
  return term;
}

}  // namespace kilotwin::identify
