#include "clients/view/live_observables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "clients/recorder/expression.hpp"
#include "core/base/error.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::view {
namespace {

using namespace std::chrono_literals;
constexpr auto kFirstInterval = 250ms;
/// Names of quantities that are relative to the first state.
constexpr std::array<const char*, 4> kSinceOpening{"displacement_mm", "displacement", "msd", "pushed"};

/// The plot of an observable: `absent` if it cannot be computed of poses, LEDs and life cycles.
PlotEntry plot_of(const proto::Observable& observable) {
  PlotEntry plot;
  plot.name = observable.name();
  std::set<std::string> unknown;
  bool since_opening = false;
  try {
    const auto expression = recorder::Expression::parse(observable.value(), [&](const std::string& name) {
      const recorder::NameKind kind = recorder::kind_of_name(name, {});
      if (kind != recorder::NameKind::kUnknown) return kind;
      unknown.insert(name);
      return recorder::NameKind::kPerRobot;
    });
    for (const std::string& name : expression.names())
      since_opening |= std::find(kSinceOpening.begin(), kSinceOpening.end(), name) != kSinceOpening.end();
  } catch (const UserError& error) {
    plot.absent = error.what();
  }
  plot.title = fmt::format("{} (observable{})", plot.name, since_opening ? ", motion since opening" : "");
  if (!unknown.empty())
    plot.absent =
        fmt::format("{} uses {}, which is in the run's recording only: give kilotwin view the run directory",
                    plot.name, fmt::join(unknown, ", "));
  return plot;
}

recorder::ObservableObserver& added(recorder::ObservableObserver& observer, double time_s, const SwarmView& swarm) {
  observer.add(time_s, swarm.x_mm, swarm.y_mm, swarm.heading_rad, swarm.movable_x_mm, swarm.movable_y_mm);
  return observer;
}

}  // namespace

LiveObservables::LiveObservables(const proto::Experiment& experiment, std::uint32_t robots)
    : interval_(kFirstInterval) {
  proto::RecordingHeader header;
  header.set_robots(robots);
  for (const proto::RobotGroup& group : experiment.robots()) header.add_group_robots(group.count());
  for (const proto::Observable& observable : experiment.observable()) {
    plots_.push_back(plot_of(observable));
    own_number_.push_back(static_cast<std::size_t>(header.observable_size()));
    if (plots_.back().absent.empty()) *header.add_observable() = observable;
  }
  own_ = std::make_unique<recorder::SwarmObservables>(header);
  values_.resize(own_->names().size());
}

void LiveObservables::take(double time_s, const SwarmView& swarm, Clock::time_point now) {
  if (!own_->any() || now < next_ || (!time_s_.empty() && time_s <= time_s_.back())) return;
  const auto began = Clock::now();
  proto::StateRecord state;
  state.mutable_x_mm()->Add(swarm.x_mm.begin(), swarm.x_mm.end());
  state.mutable_y_mm()->Add(swarm.y_mm.begin(), swarm.y_mm.end());
  state.mutable_heading_rad()->Add(swarm.heading_rad.begin(), swarm.heading_rad.end());
  state.mutable_led()->assign(swarm.led.begin(), swarm.led.end());
  state.mutable_life_cycle()->assign(swarm.life_cycle.begin(), swarm.life_cycle.end());
  const std::vector<double> values = own_->values(time_s, state, added(observer_, time_s, swarm).curves());
  time_s_.push_back(time_s);
  for (std::size_t i = 0; i < values.size(); ++i) values_[i].push_back(values[i]);
  if (time_s_.size() > kMostPoints) keep_every_second();
  next_ = now + std::max<Clock::duration>(interval_, 10 * (Clock::now() - began));
}

void LiveObservables::keep_every_second() {
  interval_ *= 2;
  const auto halve = [](std::vector<double>& column) {
    for (std::size_t i = 0; 2 * i < column.size(); ++i) column[i] = column[2 * i];
    column.resize((column.size() + 1) / 2);
  };
  halve(time_s_);
  for (std::vector<double>& column : values_) halve(column);
}

std::string LiveObservables::plot(std::uint32_t number) const {
  if (number >= plots_.size() || !plots_[number].absent.empty()) return {};
  return plot_text(number, std::nullopt, {time_s_, {"value"}, {values_[own_number_[number]]}});
}

}  // namespace kilotwin::view
