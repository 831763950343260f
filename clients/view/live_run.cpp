#include "clients/view/live_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>

#include "clients/recorder/tracker_records.hpp"
#include "clients/view/run_text.hpp"
#include "clients/view/watched_plan.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_check.hpp"
#include "core/plan/senses_settings.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::view {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookAtRecording = 250ms;
/// A place that a tracker stated is shown for so long.
constexpr auto kPlaceHolds = 1s;
constexpr std::size_t kMostTrackers = 16;
/// A run that is so many times faster than real time shows fewer states.
constexpr double kFast = 8;
constexpr auto kBetweenStatesOfAFastRun = 50ms;
/// Messages are read for so long after a viewer has asked for them.
constexpr auto kFlightsWanted = 2s;

/// Best effort, unlike the station's own reader: no federate waits for this one.
dds::Channel watched_metrics() { return {topics::metrics().topic, dds::Delivery::kSensor, ""}; }

/// Unique among processes that steer a run.
std::string client_name() { return fmt::format("kilotwin view {} {}", getpid(), random_token().substr(0, 8)); }

const char* phase_name(kilotwin_open_RunPhase phase) {
  switch (phase) {
    case kilotwin_open_STARTING: return "starting";
    case kilotwin_open_RUNNING: return "running";
    case kilotwin_open_PAUSED: return "paused";
    case kilotwin_open_ENDED: return "ended";
    default: return "broken";
  }
}

template <class Column, class Values> void take(const Column& column, Values& values) {
  if (column._length > 0) values.assign(column._buffer, column._buffer + column._length);
}

/// Nothing where the columns differ in length.
std::optional<TrackerSample> tracker_sample(const PublicTrackerFrame& frame, std::uint32_t first_robot) {
  TrackerSample sample;
  take(frame.robot, sample.robot);
  take(frame.state, sample.state);
  take(frame.x_mm, sample.x);
  take(frame.y_mm, sample.y);
  take(frame.heading_rad, sample.heading_rad);
  take(frame.xx_mm2, sample.xx);
  take(frame.xy_mm2, sample.xy);
  take(frame.yy_mm2, sample.yy);
  take(frame.heading_variance_rad2, sample.heading_variance_rad2);
  take(frame.led, sample.led);
  for (std::uint32_t& robot : sample.robot) robot += first_robot;
  if (!recorder::has_equal_columns(sample)) return std::nullopt;
  return sample;
}

std::string status_text(const PublicRunStatus& status, bool ended) {
  const nlohmann::json text{{"type", "status"},
                            {"phase", ended ? "ended" : phase_name(status.phase)},
                            {"tick", status.tick},
                            {"lastTick", status.last_tick},
                            {"simulatedSeconds", status.simulated_s},
                            {"wallSeconds", status.wall_s},
                            {"failed", status.robots_failed},
                            {"sent", status.sent},
                            {"received", status.received},
                            {"note", status.note}};
  return text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

LiveRun::LiveRun(const dds::Transport& transport, std::filesystem::path directory, bool tells)
    : directory_(std::move(directory)),
      tells_(tells),
      observer_(transport),
      participant_(transport),
      control_(participant_, topics::run_control()),
      overhead_(participant_, topics::overhead_packets()),
      relocations_(participant_, topics::relocations()),
      statuses_(participant_, topics::run_status(),
                [this](const PublicRunStatus& sample, dds::SampleState state) {
                  if (!state.valid) return;
                  const std::lock_guard lock(mutex_);
                  status_ = sample;
                  ++status_number_;
                }),
      tracker_frames_(participant_, topics::tracker_frames(),
                      [this](const PublicTrackerFrame& sample, dds::SampleState state) {
                        if (state.valid) on_tracker_frame(sample);
                      }),
      station_packets_(participant_, topics::station_packets(),
                       [this](const PublicStationPacket& sample, dds::SampleState state) {
                         if (state.valid) on_packet(sample);
                       }),
      metrics_(participant_, watched_metrics(),
               [this](const WireMetrics& sample, dds::SampleState state) {
                 if (state.valid) on_metrics(sample);
               }),
      client_(client_name()) {}

LiveRun::~LiveRun() = default;

void LiveRun::serve(Gateway& gateway) {
  switch (observer_.wait(50ms)) {
    case observe::News::kRunBegan: begin(gateway); break;
    case observe::News::kState: unposted_ = true; break;
    case observe::News::kRunEnded:
      if (unposted_ && observer_.state() != nullptr) post_state(gateway);
      post_status(gateway, true);
      ended_run_ = run_.exchange(0);
      if (tells_) say("kilotwin: the run has ended");
      return;
    case observe::News::kNothing: break;
  }
  if (observer_.run() == nullptr) return;
  if (unposted_ && observer_.state() != nullptr && (Clock::now() >= next_post_ || !runs_fast()))
    post_state(gateway);
  post_status(gateway, false);
  follow_recording();
}

std::shared_ptr<RecordedRun> LiveRun::recording() {
  const std::lock_guard lock(mutex_);
  return recording_;
}

/// Opens the recording as soon as it is there, and looks for new records from time to time.
void LiveRun::follow_recording() {
  if (directory_.empty() || run_ == 0 || Clock::now() < look_) return;
  look_ = Clock::now() + kLookAtRecording;
  if (const std::shared_ptr<RecordedRun> known = recording()) {
    static_cast<void>(known->grown());
    return;
  }
  try {
    auto found = std::make_shared<RecordedRun>(directory_);
    if (found->run() != run_) return;
    const std::lock_guard lock(mutex_);
    recording_ = std::move(found);
  } catch (const UserError&) {
    // Its first state is not written yet.
  }
}

void LiveRun::begin(Gateway& gateway) {
  const observe::RunFacts& facts = *observer_.run();
  RunOutline outline;
  outline.live = outline.federated = true;
  outline.name = facts.name;
  outline.run = facts.run;
  outline.seed = facts.seed;
  outline.tick_s = facts.tick_s;
  outline.last_tick = facts.last_tick;
  outline.robots = facts.robots;
  for (const proto::RobotGroup& group : facts.experiment->robots()) {
    const std::string program = group.behaviour_size() > 0 ? group.behaviour(0) : "";
    outline.firmware.push_back(program.ends_with(".hex") || program.ends_with(".elf"));
  }
  try {
    const std::shared_ptr<const RunPlan> plan = plan_of(*facts.experiment);
    if (plan) outline.ghost_margin_mm = ghost_margin_mm(*plan);
    const std::string text = run_text(outline, *facts.experiment);
    grid_ = grid_of(*facts.experiment);
    {
      const std::lock_guard lock(mutex_);
      run_ = facts.run;
      recording_.reset();
      plan_ = plan;
      frames_.clear();
      packets_.clear();
      live_work_.clear();
      live_flights_.clear();
      observables_.reset();
      if (directory_.empty()) observables_.emplace(*facts.experiment, facts.robots);
      x_mm_.clear();
      y_mm_.clear();
    }
    gateway.show(*this, text);
    if (tells_) say(fmt::format("kilotwin: sees run {}, {} robots", one_line(facts.name, 128), facts.robots));
  } catch (const std::invalid_argument& error) {
    warn(fmt::format("kilotwin: run {} cannot be shown: {}", one_line(facts.name, 128), one_line(error.what())));
  }
}

/// Faster than people look at runs: a run without a pace takes what the machine has, and viewers shall leave it that.
bool LiveRun::runs_fast() const {
  const observe::SwarmAt *const at = observer_.state(), *const before = observer_.earlier_state();
  if (at == nullptr || before == nullptr) return false;
  return at->time_s - before->time_s > kFast * 1e-9 * static_cast<double>(at->wall_ns - before->wall_ns);
}

void LiveRun::post_state(Gateway& gateway) {
  const SwarmView& swarm = observer_.state()->swarm;
  unposted_ = false;
  if (run_ == 0) return;
  next_post_ = Clock::now() + kBetweenStatesOfAFastRun;
  {
    const std::lock_guard lock(mutex_);
    if (observables_) observables_->take(observer_.state()->time_s, swarm, Clock::now());
    if (plan_ && plan_->light_settings()) {
      x_mm_ = swarm.x_mm;
      y_mm_ = swarm.y_mm;
    }
  }
  FrameColumns columns;
  columns.x_mm = swarm.x_mm;
  columns.y_mm = swarm.y_mm;
  columns.heading_rad = swarm.heading_rad;
  columns.led = swarm.led;
  columns.life_cycle = swarm.life_cycle;
  columns.motor_left = swarm.motor_left;
  columns.motor_right = swarm.motor_right;
  columns.movable_x_mm = swarm.movable_x_mm;
  columns.movable_y_mm = swarm.movable_y_mm;
  columns.movable_heading_rad = swarm.movable_heading_rad;
  gateway.post_frame(encode_frame({0, swarm.tick.count(), swarm.tick.count()}, columns, grid_));
}

void LiveRun::post_status(Gateway& gateway, bool ended) {
  PublicRunStatus status{};
  {
    const std::lock_guard lock(mutex_);
    if (!ended && (status_.run != run_ || posted_status_ == status_number_)) return;
    posted_status_ = status_number_;
    status = status_;
  }
  gateway.post_status(status_text(status, ended));
}

std::uint64_t LiveRun::floors_version(std::int64_t tick) {
  const std::shared_ptr<RecordedRun> recorded = recording();
  return recorded ? recorded->floors_version(tick) : 0;
}

std::string LiveRun::floors_at(std::int64_t tick) {
  const std::shared_ptr<RecordedRun> recorded = recording();
  return recorded ? recorded->floors_at(tick) : std::string();
}

std::string LiveRun::light(std::int64_t tick) {
  std::vector<double> x_mm, y_mm;
  {
    const std::lock_guard lock(mutex_);
    if (!light_ || light_of_ != run_) light_.emplace(plan_);
    light_of_ = run_;
    x_mm = x_mm_;
    y_mm = y_mm_;
  }
  return light_->text(tick, x_mm, y_mm);
}

std::string LiveRun::robot(std::uint32_t robot, std::int64_t tick) {
  const std::shared_ptr<RecordedRun> recorded = recording();
  std::set<std::uint32_t> heard;
  {
    const std::lock_guard lock(mutex_);
    flights_until_ = Clock::now() + kFlightsWanted;
    const double lately_ticks = plan_ ? kLately_s / plan_->tick_length.seconds() : 0;
    if (!recorded || !recorded->counts_messages()) return live_flights_.robot_text(robot, tick, lately_ticks);
    // The recording is up to a second late; who was heard lately is known sooner.
    heard = live_flights_.heard_lately(robot, lately_ticks);
  }
  return recorded->robot(robot, tick, heard);
}

std::string LiveRun::plots() {
  const std::shared_ptr<RecordedRun> recorded = recording();
  if (recorded) return recorded->plots();
  const std::lock_guard lock(mutex_);
  return observables_ ? observables_->list() : plots_text({});
}

std::string LiveRun::plot(std::uint32_t number, std::optional<std::uint32_t> robot) {
  const std::shared_ptr<RecordedRun> recorded = recording();
  if (recorded) return recorded->plot(number, robot);
  const std::lock_guard lock(mutex_);
  return observables_ && !robot ? observables_->plot(number) : std::string();
}

std::string LiveRun::program(std::uint32_t robot, std::int64_t tick) {
  const std::shared_ptr<RecordedRun> recorded = recording();
  return recorded ? recorded->program(robot, tick) : program_text({robot, tick, /*known=*/false, {}, {}});
}

void LiveRun::on_tracker_frame(const PublicTrackerFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (run_ == 0 || (frame.run != 0 && frame.run != run_)) return;
  static const std::vector<TrackerSettings> none;
  const std::vector<TrackerSettings>& trackers = plan_ ? plan_->tracking_settings().trackers : none;
  // Sources that the experiment does not name have no place in the arena, unless it names none.
  const auto named = std::find_if(trackers.begin(), trackers.end(), [&frame](const TrackerSettings& tracker) {
    return tracker.source == frame.source;
  });
  if (named == trackers.end() && !trackers.empty()) return;
  if (!frames_.contains(frame.source) && frames_.size() >= kMostTrackers) return;
  std::optional<TrackerSample> sample = tracker_sample(frame, named == trackers.end() ? 0 : named->first_robot);
  if (!sample) return;
  sample->source = static_cast<std::uint32_t>(named - trackers.begin());
  frames_[frame.source] = {std::move(*sample), Clock::now()};
}

void LiveRun::on_packet(const PublicStationPacket& packet) {
  const std::lock_guard lock(mutex_);
  if (packet.run != run_) return;
  if (packets_.size() == kMostPackets) packets_.pop_front();
  ShownPacket& shown = packets_.emplace_back();
  shown.time_s = packet.time_s;
  shown.command = packet.command;
  std::copy_n(packet.message, shown.message.size(), shown.message.begin());
}

std::string LiveRun::outside(std::int64_t tick) {
  std::map<std::uint32_t, TrackedPlace> places;
  Outside outside;
  {
    const std::lock_guard lock(mutex_);
    const TrackingSettings none;
    const std::vector<TrackerSettings>& trackers = (plan_ ? plan_->tracking_settings() : none).trackers;
    for (const auto& [source, frame] : frames_)
      if (Clock::now() - frame.seen < kPlaceHolds) add_places(trackers, frame.sample, places);
    outside.packets.assign(packets_.begin(), packets_.end());
  }
  for (const auto& [robot, place] : places) outside.robots.push_back(place);
  if (const std::shared_ptr<RecordedRun> recorded = recording()) outside.alarms = recorded->alarms_until(tick);
  return outside_text(tick, outside);
}

void LiveRun::on_metrics(const WireMetrics& metrics) {
  const std::lock_guard lock(mutex_);
  if (run_ == 0 || metrics.run != run_ || !plan_) return;
  const auto now = Clock::now();
  live_work_.take(metrics, now);
  if (now < flights_until_ && metrics.publisher == plan_->radio().value()) {
    live_flights_.take(metrics.observations._buffer, metrics.observations._length,
                       metrics.first_tick + metrics.hash_parts._length, plan_->tick_length);
  }
}

std::shared_ptr<const RunPlan> LiveRun::plan() {
  const std::lock_guard lock(mutex_);
  return plan_;
}

std::string LiveRun::flights(std::int64_t from, std::int64_t tick) {
  const std::lock_guard lock(mutex_);
  flights_until_ = Clock::now() + kFlightsWanted;
  return live_flights_.text(from, tick);
}

std::string LiveRun::work() {
  const std::lock_guard lock(mutex_);
  return work_text(/*live=*/true, plan_ ? live_work_.recent(*plan_) : std::vector<FederateTime>());
}

std::string LiveRun::marks() {
  const std::shared_ptr<RecordedRun> recorded = recording();
  return recorded ? recorded->marks() : marks_text({}, /*whole=*/true);
}

/// Says why the run would ignore the request, where that is known here.
std::string LiveRun::place(const Relocation& place) {
  const std::shared_ptr<const RunPlan> known = plan();
  if (const char* const why = known ? defect(place, *known) : nullptr)
    return fmt::format("{} {} stays where it is: {}.", place.movable ? "Object" : "Robot", place.body, why);
  PublicRelocation sample{};
  client_.copy(sample.client, sizeof sample.client - 1);
  sample.run = run_;
  sample.request = ++request_;
  sample.movable = place.movable;
  sample.body = place.body;
  sample.x_mm = place.pose.x_mm;
  sample.y_mm = place.pose.y_mm;
  sample.heading_rad = place.pose.heading_rad;
  relocations_.write(sample);
  return {};
}

std::string LiveRun::steer(const Request& request) {
  if (run_ == 0) return "The run has ended.";
  if (request.kind == Request::Kind::kPlace) return place(request.place);
  if (request.kind == Request::Kind::kOverhead) {
    PublicOverheadPacket packet{};
    client_.copy(packet.client, sizeof packet.client - 1);
    packet.run = run_;
    packet.request = ++request_;
    packet.command = static_cast<std::uint8_t>(request.packet.command);
    std::copy(request.packet.message.begin(), request.packet.message.end(), packet.message);
    overhead_.write(packet);
    return {};
  }
  PublicRunControl sample{};
  client_.copy(sample.client, sizeof sample.client - 1);
  sample.run = run_;
  sample.request = ++request_;
  switch (request.kind) {
    case Request::Kind::kPause: sample.command = kilotwin_open_PAUSE_RUN; break;
    case Request::Kind::kContinue: sample.command = kilotwin_open_CONTINUE_RUN; break;
    case Request::Kind::kStep:
      sample.command = kilotwin_open_STEP_RUN;
      sample.steps = request.steps;
      break;
    default: sample.command = kilotwin_open_STOP_RUN; break;
  }
  control_.write(sample);
  return {};
}

}  // namespace kilotwin::view
