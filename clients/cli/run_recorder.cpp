#include "clients/cli/run_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/cli/recovery.hpp"
#include "clients/recorder/animation.hpp"
#include "clients/recorder/observables.hpp"
#include "clients/recorder/picture.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/tracker_records.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

proto::RecordingHeader header_of(const RunPlan& plan, const recorder::RunDirectory& directory,
                                 const std::optional<Checkpoint>& resumed) {
  if (const auto earlier = earlier_recording(directory); !earlier.empty()) {
    const recorder::Reader reader(earlier);
    return recorder::recording_header(plan.manifest(), Tick{reader.header().first_tick()},
                                      reader.header().first_hash());
  }
  return recorder::recording_header(plan.manifest(), resumed ? resumed->tick : Tick{0},
                                    resumed ? resumed->hash_chain() : 0);
}

proto::InputRecord::Kind kind_of(DirectiveKind kind) {
  switch (kind) {
    case DirectiveKind::kMembership: return proto::InputRecord::MEMBERSHIP;
    case DirectiveKind::kRelocation: return proto::InputRecord::RELOCATION;
    default: return static_cast<proto::InputRecord::Kind>(kind);
  }
}

DirectiveKind kind_of(proto::InputRecord::Kind kind) {
  switch (kind) {
    case proto::InputRecord::MEMBERSHIP: return DirectiveKind::kMembership;
    case proto::InputRecord::RELOCATION: return DirectiveKind::kRelocation;
    default: return static_cast<DirectiveKind>(kind);
  }
}

}  // namespace

RunRecorder::RunRecorder(const RunPlan& plan, const recorder::RunDirectory& directory,
                         const std::optional<Checkpoint>& resumed, std::function<void(const RunProgress&)> on_idle)
    : plan_(plan),
      directory_(directory),
      header_(header_of(plan, directory, resumed)),
      writer_(directory.recording(), header_),
      when_(plan.tick_length, plan.recording_settings().every_s),
      on_idle_(std::move(on_idle)),
      state_(plan),
      changes_(plan) {
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.cell_side_mm(robot) > 0) displacement_.leave_out(robot);
  }
  if (const auto earlier = earlier_recording(directory); !earlier.empty())
    take_over(earlier, resumed ? resumed->tick : Tick{0});
}

void RunRecorder::take_over(const std::filesystem::path& earlier, Tick until) {
  recovered_from_ = until;
  recorder::Reader reader(earlier);
  using recorder::values;
  const auto octets = [](const std::string& text) {
    return std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());  // NOLINT
  };
  while (const proto::Record* record = reader.next()) {
    if (record->has_state() && Tick{record->state().tick()} <= until) {
      const proto::StateRecord& state = record->state();
      const Tick tick{state.tick()};
      writer_.state({tick, values(state.x_mm()), values(state.y_mm()), values(state.heading_rad()),
                     octets(state.led()), octets(state.life_cycle()), values(state.movable_x_mm()),
                     values(state.movable_y_mm()), values(state.movable_heading_rad()),
                     values(state.measured_x_mm()), values(state.measured_y_mm()),
                     values(state.measured_heading_rad())});
      displacement_.add(values(state.x_mm()), values(state.y_mm()));
      any_state_ = true;
      next_ = when_.at_or_after(tick + 1);
    } else if (record->has_hash()) {
      Tick tick{record->hash().first_tick()};
      for (const std::uint64_t chain : record->hash().chain()) {
        if (tick <= until) writer_.hash(tick, chain);
        ++tick;
      }
    } else if (record->has_floor() && Tick{record->floor().tick()} <= until) {
      writer_.floor(record->floor());
    } else if (record->has_variable() && Tick{record->variable().tick()} < until) {
      writer_.variable(record->variable());
    } else if (record->has_event() && Tick{record->event().tick()} < until) {
      changes_.take(record->event(), plan_.robots());
      take_event(record->event());
    } else if (record->has_input()) {
      const Directive input = from_record(record->input());
      if (input.tick < until || changes_results(input)) writer_.input(record->input());
    } else if (record->has_tracker() && Tick{record->tracker().tick()} < until) {
      writer_.tracker(record->tracker());  // later ones are inputs of this attempt, and come by tracker_sample()
    }
  }
  // This attempt may end before its first flush, and its recording replaces the earlier one.
  writer_.flush();
}

void RunRecorder::state(Tick tick, const SwarmView& swarm, bool last) {
  if (first_tick_at_ == std::chrono::steady_clock::time_point{}) first_tick_at_ = std::chrono::steady_clock::now();
  if (monitor_) monitor_->state(swarm);
  if (changes_.any()) {
    proto::Observations changed;
    changes_.observe(swarm, changed);
    observed(changed);
  }
  if (any_state_ && tick < next_ && !last) return;
  any_state_ = true;
  next_ = when_.at_or_after(tick + 1);
  writer_.state(state_.of(swarm));
  displacement_.add(swarm.x_mm, swarm.y_mm);
}

void RunRecorder::hash(Tick tick, std::uint64_t chain) { writer_.hash(tick, chain); }

void RunRecorder::input(const Directive& directive) {
  writer_.input(to_record(directive));
  inputs_wait_ = true;
}

void RunRecorder::floor(Tick tick, const FloorPicture& floor) {
  proto::FloorRecord record;
  record.set_tick(tick.count());
  record.set_environment(floor.environment);
  record.set_columns(floor.columns);
  record.set_rows(floor.rows);
  record.set_rgba(floor.rgba);
  for (const FloorPicture::Circle& circle : floor.circles) {
    for (const double value : {circle.x_mm, circle.y_mm, circle.radius_mm}) record.add_circle_mm(value);
    record.mutable_circle_rgba()->append(circle.rgba.begin(), circle.rgba.end());
    record.add_circle_name(circle.name);
  }
  writer_.floor(record);
}

void RunRecorder::tracker_sample(Tick tick, const TrackerSample& sample) {
  writer_.tracker(recorder::to_record(tick, sample));
  if (monitor_) monitor_->tracker_sample(sample);
  inputs_wait_ = true;
}

void RunRecorder::observed(const proto::Observations& observations) {
  if (monitor_) monitor_->observed(observations);
  for (const proto::VariableRecord& variable : observations.variable()) writer_.variable(variable);
  for (const proto::EventRecord& event : observations.event()) take_event(event);
}

void RunRecorder::take_event(const proto::EventRecord& event) {
  writer_.event(event);
  if (event.kind() != proto::FAILURE) return;
  for (int i = 0; i < event.robot_size(); ++i)
    failures_.push_back({event.robot(i), plan_.tick_length.seconds_at(Tick{event.tick()}), event.text(i)});
}

void RunRecorder::saved() { writer_.flush(); }

void RunRecorder::idle(const RunProgress& progress) {
  // An external input cannot be repeated, so write it to disk at once.
  if (std::exchange(inputs_wait_, false))
    writer_.flush();
  else
    writer_.flush_if_due();
  if (on_idle_) on_idle_(progress);
}

void RunRecorder::record_counts(const RunTotals& totals) {
  if (plan_.recording_settings().messages) {
    proto::MessagesRecord messages;
    for (const PairCount& pair : totals.pairs) {
      messages.add_receiver(pair.receiver);
      messages.add_sender(pair.sender);
      messages.add_count(pair.count);
    }
    writer_.messages(messages);
  }
  if (totals.radios.size() == plan_.robots()) {
    proto::RadioRecord radios;
    for (const RadioCount& radio : totals.radios) {
      radios.add_attempted(radio.attempted);
      radios.add_sent(radio.sent);
      radios.add_received(radio.received);
      radios.add_collided(radio.collided);
      radios.add_backed_off(radio.backed_off);
    }
    writer_.radio(radios);
  }
}

recorder::Summary RunRecorder::summary_of(const RunTotals& totals, double start_s) {
  recorder::Summary summary;
  summary.name = plan_.experiment_name();
  summary.seed = plan_.seed();
  summary.mode = plan_.mode;
  summary.partition_columns = plan_.grid.columns();
  summary.partition_rows = plan_.grid.rows();
  summary.hosts = plan_.hosts;
  for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot)
    ++(plan_.cell_side_mm(robot) > 0 ? summary.cells : summary.robots);
  summary.ticks = std::max<std::int64_t>(0, totals.last.count());
  summary.resumed_from_tick = header_.first_tick();
  summary.recovered_from_tick = recovered_from_.count();
  summary.simulated_s = plan_.tick_length.seconds() * static_cast<double>(summary.ticks);
  summary.start_s = start_s;
  summary.wall_s = totals.wall_s;
  summary.cpu_s = totals.cpu_s;
  summary.peak_memory_mib = totals.peak_memory_mib;
  summary.state_hash = totals.state_hash;
  summary.failure = totals.failure;
  summary.messages = {totals.attempted, totals.sent, totals.received, totals.collided};
  for (std::uint32_t robot = 0; robot < totals.radios.size(); ++robot) {
    if (!(plan_.cell_side_mm(robot) > 0)) summary.per_robot.add(totals.radios[robot]);
  }
  summary.robots_failed = totals.robots_failed;
  std::stable_sort(failures_.begin(), failures_.end(),
                   [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  summary.failures = std::move(failures_);
  summary.station = totals.station;
  summary.recoveries = static_cast<std::uint32_t>(plan_.program_failures().size());
  summary.paced = plan_.pace > 0;
  summary.lateness = totals.lateness;
  summary.tracked = plan_.any_tracked();
  summary.tracking = totals.tracking;
  if (monitor_) summary.monitor = monitor_->report();
  summary.moved_mm = {displacement_.mean_distance_mm(), displacement_.max_distance_mm()};
  const double steps =
      static_cast<double>(std::max<std::int64_t>(1, totals.last - totals.first)) * std::max(1u, plan_.robots());
  const auto cost = [&](Work work) {
    return static_cast<double>(totals.work_ns[static_cast<std::size_t>(work)]) / steps;
  };
  auto& costs = summary.cost_ns_per_robot_tick;
  costs.behaviours = cost(Work::kBehaviours);
  costs.physics = cost(Work::kPhysics);
  costs.radio = cost(Work::kRadio);
  costs.station = cost(Work::kStation);
  costs.exchange = cost(Work::kExchange);
  costs.recording = cost(Work::kRecording);
  summary.federates = totals.federates;
  summary.provenance = recorder::read_provenance(directory_.provenance()).value_or(recorder::Provenance{});
  return summary;
}

recorder::Summary RunRecorder::finish(const RunTotals& totals, double start_s) {
  record_counts(totals);
  // A run that failed before the first state hash ends at its first tick.
  writer_.end(std::max(totals.last, totals.first), totals.state_hash, totals.failure);

  recorder::Summary summary = summary_of(totals, start_s);
  if (header_.observable_size() > 0 && any_state_) {
    recorder::Reader recording(directory_.recording());
    for (const recorder::OwnCurve& own : recorder::observe(recording).own)
      summary.observables.emplace_back(own.name, own.value.empty() ? std::nan("") : own.value.back());
  }
  recorder::write_summary(summary, directory_.summary());
  if (any_state_) {
    recorder::Reader recording(directory_.recording());
    const recorder::RunOverview overview = recorder::read_overview(recording);
    os::write_file(directory_.picture(), recorder::picture_svg(overview));
    if (const std::string animation = recorder::animation_svg(overview); !animation.empty())
      os::write_file(directory_.animation(), animation);
  }
  return summary;
}

proto::InputRecord to_record(const Directive& directive) {
  proto::InputRecord record;
  record.set_sequence_number(directive.sequence_number);
  record.set_tick(directive.tick.count());
  record.set_kind(kind_of(directive.kind));
  if (directive.kind == DirectiveKind::kStep) record.set_steps(directive.steps);
  if (directive.kind == DirectiveKind::kOverheadInput) {
    record.set_packet(octets_of(directive.packet));
    if (const std::uint32_t offset = directive.packet.offset_cycles(); offset != 0)
      record.set_packet_offset_cycles(offset);
  }
  if (directive.kind == DirectiveKind::kMembership) {
    record.set_robot(directive.membership.robot);
    record.set_membership(static_cast<proto::InputRecord::Membership>(directive.membership.membership));
  }
  if (directive.kind == DirectiveKind::kRelocation) {
    const auto& [movable, body, pose] = directive.relocation;
    record.set_robot(body);
    record.set_movable(movable);
    record.set_x_mm(pose.x_mm);
    record.set_y_mm(pose.y_mm);
    record.set_heading_rad(pose.heading_rad);
  }
  return record;
}

Directive from_record(const proto::InputRecord& record) {
  Directive directive;
  directive.sequence_number = record.sequence_number();
  directive.tick = Tick{record.tick()};
  directive.kind = kind_of(record.kind());
  directive.steps = record.steps();
  directive.packet = packet_of(record.packet()).value_or(OverheadPacket{}).at(record.packet_offset_cycles());
  directive.membership = {record.robot(), static_cast<Membership>(record.membership())};
  directive.relocation = {record.movable(), record.robot(), {record.x_mm(), record.y_mm(), record.heading_rad()}};
  return directive;
}

}  // namespace kilotwin::cli
