#include "services/ark/tracker_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <span>

#include "core/base/say.hpp"
#include "core/plan/tracking_settings.hpp"

namespace kilotwin::ark {
namespace {

/// Samples that may wait for the station: two seconds of 16 trackers at 30 Hz.
constexpr std::size_t kMostFramesWaiting = 1024;
constexpr std::size_t kMostSources = 16;
/// As many frames as a writer repeats.
constexpr std::size_t kRecent = 64;
/// Numbers of a tracker beyond this are no places.
constexpr double kFarthest = 1e9;
/// Times beyond this, about 127 years around the epoch of the source's clock, are no times.
constexpr std::int64_t kFarthest_ns = 4'000'000'000'000'000'000;

template <class Sequence> auto values(const Sequence& sequence) {
  return std::span(sequence._buffer, sequence._length);
}

std::int64_t ns_of(TrackerInput::Clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

}  // namespace

TrackerInput::TrackerInput(const RunPlan& plan, const dds::Participant& participant)
    : plan_(plan),
      reader_(participant, topics::tracker_frames(),
              [this](const PublicTrackerFrame& sample, dds::SampleState state) {
                if (state.valid) on_sample(sample);
              }),
      repeated_reader_(participant, topics::played_frames(),
                       [this](const PublicTrackerFrame& sample, dds::SampleState state) {
                         if (state.valid) on_sample(sample);
                       }) {}

/// Whether this very frame came already, by the other reader.
bool TrackerInput::is_repeated(std::size_t source, const PublicTrackerFrame& sample) {
  if (source >= recent_.size()) recent_.resize(source + 1);
  auto& recent = recent_[source];
  const std::pair frame(sample.frame, sample.capture_ns);
  if (std::find(recent.begin(), recent.end(), frame) != recent.end()) return true;
  recent.push_back(frame);
  if (recent.size() > kRecent) recent.pop_front();
  return false;
}

/// The index of a source; -1 where the experiment does not name it, or where there are too many. With the mutex held.
std::ptrdiff_t TrackerInput::source_of(const char* name) {
  const std::vector<TrackerSettings>& known = plan_.tracking_settings().trackers;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i].source == name) return static_cast<std::ptrdiff_t>(i);
  }
  if (!known.empty()) return -1;
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) return found - names_.begin();
  if (names_.size() == kMostSources) return -1;
  names_.emplace_back(name);
  return static_cast<std::ptrdiff_t>(names_.size()) - 1;
}

/// Takes the entries of tracked robots. False where the columns differ in length.
bool TrackerInput::copy(const PublicTrackerFrame& from, TrackerSample& to, std::uint32_t first_robot) const {
  const std::size_t n = from.robot._length;
  for (const std::size_t length :
       {std::size_t{from.state._length}, std::size_t{from.x_mm._length}, std::size_t{from.y_mm._length},
        std::size_t{from.heading_rad._length}, std::size_t{from.xx_mm2._length}, std::size_t{from.xy_mm2._length},
        std::size_t{from.yy_mm2._length}, std::size_t{from.heading_variance_rad2._length},
        std::size_t{from.led._length}}) {
    if (length != n) return false;
  }
  // Velocities are for observers, and may be left out.
  if (from.vx_mm_s._length != from.vy_mm_s._length || (from.vx_mm_s._length != n && from.vx_mm_s._length != 0))
    return false;
  std::set<std::uint32_t> seen;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t robot = std::uint64_t{values(from.robot)[i]} + first_robot;
    const double x = values(from.x_mm)[i], y = values(from.y_mm)[i], heading = values(from.heading_rad)[i];
    const std::uint8_t state = values(from.state)[i], led = values(from.led)[i];
    if (robot >= plan_.robots() || !plan_.tracked(static_cast<std::uint32_t>(robot)) ||
        !(std::abs(x) <= kFarthest) || !(std::abs(y) <= kFarthest) ||
        state > static_cast<std::uint8_t>(TrackedState::kInDoubt) ||
        !seen.insert(static_cast<std::uint32_t>(robot)).second) {
      continue;
    }
    const auto variance = [](float value) { return std::isfinite(value) ? value : 0.0f; };
    const bool knows_heading = std::abs(heading) < kFarthest;
    const float heading_variance = values(from.heading_variance_rad2)[i];
    to.robot.push_back(static_cast<std::uint32_t>(robot));
    to.state.push_back(state);
    to.x.push_back(static_cast<float>(x));
    to.y.push_back(static_cast<float>(y));
    to.heading_rad.push_back(knows_heading ? static_cast<float>(heading) : 0.0f);
    to.xx.push_back(variance(values(from.xx_mm2)[i]));
    to.xy.push_back(variance(values(from.xy_mm2)[i]));
    to.yy.push_back(variance(values(from.yy_mm2)[i]));
    to.heading_variance_rad2.push_back(knows_heading && heading_variance >= 0 ? heading_variance : INFINITY);
    to.led.push_back(led < 64 ? led : kUnknownLed);
  }
  return true;
}

void TrackerInput::on_sample(const PublicTrackerFrame& sample) {
  const Clock::time_point arrival = Clock::now();
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  if (sample.run != 0 && sample.run != plan_.run()) return;
  const std::lock_guard lock(mutex_);
  const std::ptrdiff_t source = source_of(sample.source);
  if (source < 0) return;
  const auto is_time = [](std::int64_t ns) { return ns >= -kFarthest_ns && ns <= kFarthest_ns; };
  if (!is_time(sample.capture_ns) || !is_time(sample.sent_ns)) {
    ++malformed_;
    return;
  }
  if (is_repeated(static_cast<std::size_t>(source), sample)) return;
  const auto& trackers = plan_.tracking_settings().trackers;
  Waiting waiting{};
  waiting.source = static_cast<std::uint32_t>(source);
  waiting.arrival = arrival;
  waiting.time = {sample.frame,   sample.capture_ns,
                  sample.sent_ns, sample.clock == 1,
                  ns_of(arrival), std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count()};
  waiting.sample.source = waiting.source;
  waiting.sample.frame = sample.frame;
  const std::uint32_t first_robot = trackers.empty() ? 0 : trackers[waiting.source].first_robot;
  if (!copy(sample, waiting.sample, first_robot)) {
    ++malformed_;
    return;
  }
  waiting_.push_back(std::move(waiting));
  if (waiting_.size() <= kMostFramesWaiting) return;
  waiting_.pop_front();
  ++flooded_;
}

/// Counts lost frames, and says when a source's clock restarted or is wrong.
void TrackerInput::watch(Source& source, const Waiting& waiting) {
  if (source.frames > 1 && waiting.time.frame > source.last_frame + 1)
    source.dropped += waiting.time.frame - source.last_frame - 1;
  source.last_frame = waiting.time.frame;
  if (source.clock.restarts() != source.restarts) {
    source.restarts = source.clock.restarts();
    // Of a clock that is set again and again, fewer and fewer lines.
    if (std::has_single_bit(source.restarts)) {
      say(fmt::format(
          "tracker {}: it restarted, or its clock was set ({} times so far); its time is estimated again",
          source.name, source.restarts));
    }
  }
  if (source.clock.wrong_utc_s() == 0 || source.said_wrong_utc) return;
  source.said_wrong_utc = true;
  const double ahead_s = source.clock.wrong_utc_s();
  const bool is_tai = std::abs(ahead_s - ClockModel::kTaiLead_s) < 1;
  say(fmt::format(
      "tracker {}: its clock, said to show UTC, is {:.3f} s {} this machine's{}; its time is estimated instead",
      source.name, std::abs(ahead_s), ahead_s > 0 ? "ahead of" : "behind", is_tai ? ": it shows TAI" : ""));
}

std::vector<TrackerInput::Stamped> TrackerInput::take(Clock::time_point now, std::int64_t now_cycle, double pace) {
  std::deque<Waiting> waiting;
  std::vector<std::string> names;
  {
    const std::lock_guard lock(mutex_);
    waiting.swap(waiting_);
    names = names_;
  }
  const auto& trackers = plan_.tracking_settings().trackers;
  std::vector<Stamped> stamped;
  for (Waiting& arrived : waiting) {
    if (arrived.source >= sources_.size()) sources_.resize(arrived.source + 1);
    Source& source = sources_[arrived.source];
    if (source.name.empty())
      source.name = one_line(trackers.empty() ? names[arrived.source] : trackers[arrived.source].source);
    ++source.frames;
    const auto stamp = source.clock.take(arrived.time);
    watch(source, arrived);
    if (!stamp) continue;
    if (arrived.time.sent_ns != 0) source.own.add(static_cast<double>(stamp->sent_ns - stamp->capture_ns) * 1e-9);
    source.way.add(static_cast<double>(arrived.time.arrival_ns - stamp->sent_ns) * 1e-9);
    const double age_s = static_cast<double>(ns_of(now) - stamp->capture_ns) * 1e-9;
    arrived.sample.capture_cycle = now_cycle - std::llround(age_s * pace * kNominalClockHz);
    stamped.push_back({std::move(arrived.sample), Clock::time_point(std::chrono::nanoseconds(stamp->capture_ns)),
                       arrived.arrival});
  }
  return stamped;
}

std::vector<TrackerReport> TrackerInput::report() const {
  std::vector<TrackerReport> reports;
  for (const Source& source : sources_) {
    if (source.frames == 0) continue;
    TrackerReport report;
    report.source = source.name;
    report.frames = source.frames;
    report.dropped = source.dropped;
    report.refused = source.clock.refused();
    report.restarts = source.clock.restarts();
    report.offset_s = static_cast<double>(source.clock.offset_ns()) * 1e-9;
    report.drift_ppm = source.clock.drift_ppm();
    report.own_p50_s = source.own.quantile_s(0.5);
    report.own_p99_s = source.own.quantile_s(0.99);
    report.way_p50_s = source.way.quantile_s(0.5);
    report.way_p99_s = source.way.quantile_s(0.99);
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace kilotwin::ark
