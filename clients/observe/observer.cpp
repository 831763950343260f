#include "clients/observe/observer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/base/say.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::observe {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSayAfter = std::chrono::seconds(1);

/// Bounds of what a description may claim: idl/experiment.proto.
constexpr std::uint32_t kMostRobots = 100'000, kMostMovables = 1'000;

std::optional<RunFacts> facts_of(const PublicRunDescription& sample) {
  if (sample.robots > kMostRobots || sample.movables > kMostMovables || !(sample.tick_s > 0)) return std::nullopt;
  RunFacts facts;
  facts.run = sample.run;
  facts.name = sample.name;
  facts.seed = sample.seed;
  facts.tick_s = sample.tick_s;
  facts.last_tick = sample.last_tick;
  facts.robots = sample.robots;
  facts.movables = sample.movables;
  const auto experiment = std::make_shared<proto::Experiment>();
  if (!experiment->ParseFromArray(sample.experiment._buffer, static_cast<int>(sample.experiment._length)))
    return std::nullopt;
  facts.experiment = experiment;
  return facts;
}

/// Copies a column of the expected length; false where it has another.
template <class Sequence, class Value> bool copy(const Sequence& from, std::vector<Value>& to) {
  if (from._length != to.size()) return false;
  std::copy_n(from._buffer, from._length, to.begin());
  return true;
}

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

bool fill(const PublicSwarmState& from, SwarmAt& to) {
  SwarmView& swarm = to.swarm;
  if (from.tick < 0 || !copy(from.x_mm, swarm.x_mm) || !copy(from.y_mm, swarm.y_mm) ||
      !copy(from.heading_rad, swarm.heading_rad) || !copy(from.led, swarm.led) ||
      !copy(from.life_cycle, swarm.life_cycle) || !copy(from.motor_left, swarm.motor_left) ||
      !copy(from.motor_right, swarm.motor_right) || !copy(from.movable_x_mm, swarm.movable_x_mm) ||
      !copy(from.movable_y_mm, swarm.movable_y_mm) || !copy(from.movable_heading_rad, swarm.movable_heading_rad))
    return false;
  for (const auto* column : {&swarm.x_mm, &swarm.y_mm, &swarm.heading_rad, &swarm.movable_x_mm, &swarm.movable_y_mm,
                             &swarm.movable_heading_rad}) {
    if (!all_finite(*column)) return false;
  }
  swarm.tick = Tick{from.tick};
  to.time_s = from.time_s;
  to.wall_ns = from.wall_ns;
  return true;
}

}  // namespace

Observer::Observer(const dds::Transport& transport)
    : transport_(transport), waiting_since_(Clock::now()), participant_(transport) {
  descriptions_ = std::make_unique<dds::Reader<PublicRunDescription>>(
      participant_, topics::run_description(),
      [this](const PublicRunDescription& sample, dds::SampleState state) { on_description(sample, state); });
  states_ = std::make_unique<dds::Reader<PublicSwarmState>>(
      participant_, topics::swarm(), [this](const PublicSwarmState& sample, dds::SampleState state) {
        if (state.valid) on_state(sample);
      });
}

Observer::~Observer() = default;

void Observer::on_description(const PublicRunDescription& sample, dds::SampleState state) {
  if (!state.alive) {
    const std::lock_guard lock(mutex_);
    if (!current_ || current_->run != sample.run) return;
    if (begun_ && begun_->run == sample.run)
      begun_.reset();  // it began and ended before the caller looked
    else
      ended_ = sample.run;
    current_.reset();
    arrived_.notify_one();
    return;
  }
  if (!state.valid) return;
  std::optional<RunFacts> facts = facts_of(sample);
  if (!facts)
    return warn(fmt::format("kilotwin: ignored a description of run {:016x} that is malformed", sample.run));
  const std::lock_guard lock(mutex_);
  if (current_ && current_->run == facts->run) return;
  // A run that was lost without a word gives way to the next one.
  if (current_ && !(begun_ && begun_->run == current_->run)) ended_ = current_->run;
  current_ = facts;
  begun_ = std::move(facts);
  newest_.reset();
  spare_.reset();
  arrived_.notify_one();
}

void Observer::on_state(const PublicSwarmState& sample) {
  std::unique_ptr<SwarmAt> into;
  {
    const std::lock_guard lock(mutex_);
    if (!current_ || sample.run != current_->run) return;
    into = std::move(spare_);
    if (!into) into = std::make_unique<SwarmAt>(current_->robots, current_->movables);
  }
  const bool good = fill(sample, *into);
  const std::lock_guard lock(mutex_);
  // The run may have changed meanwhile; a malformed state did not come from a station of ours.
  if (!good || !current_ || sample.run != current_->run) return;
  if (newest_) spare_ = std::move(newest_);
  newest_ = std::move(into);
  arrived_.notify_one();
}

std::optional<News> Observer::take_news() {
  if (run_ && ended_ == run_->run) {
    // The last state comes before the end.
    if (newest_ && !begun_) return take_state();
    ended_.reset();
    run_.reset();
    state_.reset();
    earlier_.reset();
    waiting_since_ = Clock::now();
    said_ = false;
    return News::kRunEnded;
  }
  if (begun_) {
    run_ = std::move(begun_);
    begun_.reset();
    ended_.reset();
    state_.reset();
    earlier_.reset();
    return News::kRunBegan;
  }
  if (run_ && newest_) return take_state();
  return std::nullopt;
}

News Observer::take_state() {
  if (earlier_ && !spare_) spare_ = std::move(earlier_);
  earlier_ = std::move(state_);
  state_ = std::move(newest_);
  return News::kState;
}

News Observer::wait(std::chrono::milliseconds patience) {
  const auto until = Clock::now() + patience;
  std::unique_lock lock(mutex_);
  for (;;) {
    if (const std::optional<News> news = take_news()) return *news;
    const auto now = Clock::now();
    if (!run_ && !said_ && now >= waiting_since_ + kSayAfter) {
      said_ = true;
      lock.unlock();
      say_that_none_is_there();
      lock.lock();
      continue;
    }
    if (now >= until) return News::kNothing;
    const auto wake = !run_ && !said_ ? std::min(until, waiting_since_ + kSayAfter) : until;
    arrived_.wait_until(lock, wake);
  }
}

void Observer::say_that_none_is_there() {
  say(fmt::format("kilotwin: waiting for a run on domain {}: kilotwin run EXPERIMENT --domain {}",
                  transport_.domain, transport_.domain));
}

}  // namespace kilotwin::observe
