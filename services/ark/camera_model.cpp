#include "services/ark/camera_model.hpp"

#include <algorithm>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

constexpr double kSecondsPerHour = 3600;
constexpr std::uint32_t kWholeFrame = 0xffffffffu;  // the entity of draws that concern no single robot
// Draws per robot and frame; 0 and 1 are the position's noise. Pairs of robots come last.
enum Draw : std::uint32_t { kLedError = 2, kLedOther = 3, kLoss = 4, kLossLength = 5, kFirstPair = 6 };

constexpr std::uint8_t kSeenBit = 128, kClassMask = 3;
constexpr int kShownColumns = 5;

template <class T> void push(std::vector<T>& buffer, T value, std::size_t depth) {
  if (buffer.size() == depth) buffer.erase(buffer.begin());
  buffer.push_back(value);
}

LedClass most_frequent(const std::vector<LedClass>& classes) {
  std::array<int, 4> counts{};
  for (const LedClass led : classes) ++counts[static_cast<std::size_t>(led)];
  return static_cast<LedClass>(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

void save_shown(const SeenRobots& seen, google::protobuf::RepeatedField<double>& columns, std::string& leds) {
  for (std::size_t i = 0; i < seen.x_mm.size(); ++i) {
    for (const double value : {seen.x_mm[i], seen.y_mm[i], seen.heading_rad[i], seen.vx_mm[i], seen.vy_mm[i]})
      columns.Add(value);
    leds.push_back(static_cast<char>(static_cast<std::uint8_t>(seen.led[i]) |
                                     (seen.seen[i] != 0 ? kSeenBit : std::uint8_t{0})));
  }
}

SeenRobots load_shown(const google::protobuf::RepeatedField<double>& columns, int first, const std::string& leds,
                      std::size_t first_led, std::size_t robots) {
  SeenRobots seen;
  seen.resize(robots);
  for (std::size_t i = 0; i < robots; ++i) {
    const int at = first + static_cast<int>(i) * kShownColumns;
    seen.x_mm[i] = columns[at];
    seen.y_mm[i] = columns[at + 1];
    seen.heading_rad[i] = columns[at + 2];
    seen.vx_mm[i] = columns[at + 3];
    seen.vy_mm[i] = columns[at + 4];
    const auto octet = static_cast<std::uint8_t>(leds[first_led + i]);
    seen.led[i] = static_cast<LedClass>(octet & kClassMask);
    seen.seen[i] = (octet & kSeenBit) != 0 ? 1 : 0;
  }
  return seen;
}

}  // namespace

LedClass led_class(std::uint8_t led) {
  const double r = led & 3, g = led >> 2 & 3, b = led >> 4 & 3;
  const double red = r - (0.65 * b + 0.75 * g), green = g - (0.65 * b + 0.6 * r), blue = b - (0.6 * r + 0.56 * g);
  if (red > 0 && red >= green && red >= blue) return LedClass::kRed;
  if (green > 0 && green >= blue) return LedClass::kGreen;
  return blue > 0 ? LedClass::kBlue : LedClass::kOff;
}

CameraModel::CameraModel(const RunPlan& plan, const CameraSettings& setting)
    : tick_length_(plan.tick_length), setting_(setting), random_(plan.seed()), tracks_(plan.robots()) {
  tracked_.resize(tracks_.size());
  for (std::uint32_t track = 0; track < tracks_.size(); ++track) {
    tracks_[track].follows = track;
    // ARK's first direction, before anything has moved: to the lower right of its picture.
    tracked_.heading_rad[track] = -kPi / 4;
  }
  shown_ = tracked_;
}

Tick CameraModel::exposed_at(std::int64_t frame) const {
  return tick_length_.at_or_after(static_cast<double>(frame) / setting_.frame_rate_hz);
}

Tick CameraModel::shown_at(std::int64_t frame) const {
  return tick_length_.at_or_after(static_cast<double>(frame) / setting_.frame_rate_hz + setting_.latency_s);
}

void CameraModel::step(const SwarmView& swarm, const MeasuredPoses* measured) {
  for (; exposed_at(frame_) <= swarm.tick; ++frame_) {
    const bool is_dropped = frame_ > 0 && random_.uniform(Stream::kStationCamera, kWholeFrame, Tick{frame_}, 0) <
                                              setting_.dropped_frames;
    if (is_dropped) continue;
    expose(swarm, measured);
    if (frame_ == 0)
      shown_ = tracked_;
    else
      waiting_.push_back({frame_, tracked_});
  }
  while (!waiting_.empty() && shown_at(waiting_.front().frame) <= swarm.tick) {
    shown_ = std::move(waiting_.front().seen);
    waiting_.pop_front();
  }
}

void CameraModel::expose(const SwarmView& swarm, const MeasuredPoses* measured) {
  for (std::uint32_t track = 0; track < tracks_.size(); ++track) {
    lose(track);
    const std::uint32_t robot = tracks_[track].follows;
    if (is_absent(swarm, robot)) forget(track);
    if (tracked_.seen[track] == 0) continue;
    const Place truth = measured != nullptr ? Place{measured->x_mm[robot], measured->y_mm[robot]}
                                            : Place{swarm.x_mm[robot], swarm.y_mm[robot]};
    see(track, truth, swarm.led[robot]);
  }
  exchange_identities();
}

void CameraModel::lose(std::uint32_t track) {
  Track& it = tracks_[track];
  const double per_frame = setting_.losses_per_hour / (kSecondsPerHour * setting_.frame_rate_hz);
  if (frame_ > 0 && it.lost_until <= frame_ &&
      random_.uniform(Stream::kStationCamera, track, Tick{frame_}, kLoss) < per_frame) {
    const double u = random_.uniform(Stream::kStationCamera, track, Tick{frame_}, kLossLength);
    it.lost_until = frame_ + 1 + static_cast<std::int64_t>(-kt_log(u) * setting_.lost_s * setting_.frame_rate_hz);
    forget(track);
  }
  tracked_.seen[track] = it.lost_until <= frame_ ? 1 : 0;
}

/// The track is lost in this frame, and its buffers are cleared.
void CameraModel::forget(std::uint32_t track) {
  tracks_[track].positions.clear();
  tracks_[track].motions.clear();
  tracks_[track].colours.clear();
  tracked_.seen[track] = 0;
}

void CameraModel::see(std::uint32_t track, Place truth, std::uint8_t led) {
  Track& it = tracks_[track];
  const auto noise = random_.normal_pair(Stream::kStationCamera, track, Tick{frame_}, 0);
  const Place place{truth.x + setting_.position_noise_mm * noise[0],
                    truth.y + setting_.position_noise_mm * noise[1]};
  tracked_.x_mm[track] = place.x;
  tracked_.y_mm[track] = place.y;
  push(it.positions, place, kPositions);
  if (const std::size_t count = it.positions.size(); count > 1) {
    Place first = it.positions.front(), last = it.positions.back();
    double frames = 1;
    if (count > 2) {
      const Place second = it.positions[1], last_but_one = it.positions[count - 2];
      first = {(first.x + second.x) / 2, (first.y + second.y) / 2};
      last = {(last.x + last_but_one.x) / 2, (last.y + last_but_one.y) / 2};
      frames = static_cast<double>(count) - 2;
    }
    const double per_s = setting_.frame_rate_hz / frames;
    push(it.motions, Place{(last.x - first.x) * per_s, (last.y - first.y) * per_s}, kMotions);
    Place sum{0, 0};
    double weights = 0, weight = 0;
    for (const Place& motion : it.motions) {
      weight += 1;
      weights += weight;
      sum = {sum.x + weight * motion.x, sum.y + weight * motion.y};
    }
    tracked_.vx_mm[track] = sum.x / weights;
    tracked_.vy_mm[track] = sum.y / weights;
    if (sum.x != 0 || sum.y != 0) tracked_.heading_rad[track] = kt_atan2(sum.y, sum.x);
  }
  auto colour = static_cast<unsigned>(led_class(led));
  if (random_.uniform(Stream::kStationCamera, track, Tick{frame_}, kLedError) < setting_.led_error) {
    const double other = random_.uniform(Stream::kStationCamera, track, Tick{frame_}, kLedOther);
    colour = (colour + 1 + static_cast<unsigned>(other * 3)) % 4;
  }
  push(it.colours, static_cast<LedClass>(colour), kColours);
  tracked_.led[track] = most_frequent(it.colours);
}

void CameraModel::exchange_identities() {
  const double per_frame = setting_.swaps_per_hour / (kSecondsPerHour * setting_.frame_rate_hz);
  if (per_frame <= 0 || frame_ == 0) return;
  const double limit = setting_.swap_distance_mm * setting_.swap_distance_mm;
  for (std::uint32_t a = 0; a < tracks_.size(); ++a) {
    if (tracked_.seen[a] == 0) continue;
    for (std::uint32_t b = a + 1; b < tracks_.size(); ++b) {
      const double dx = tracked_.x_mm[a] - tracked_.x_mm[b], dy = tracked_.y_mm[a] - tracked_.y_mm[b];
      if (dx * dx + dy * dy >= limit || tracked_.seen[b] == 0) continue;
      if (random_.uniform(Stream::kStationCamera, a, Tick{frame_}, kFirstPair + b) < per_frame)
        std::swap(tracks_[a].follows, tracks_[b].follows);
    }
  }
}

std::uint64_t CameraModel::word() const {
  HashState hash(static_cast<std::uint64_t>(frame_));
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    hash.add(tracks_[i].follows);
    hash.add(static_cast<std::uint64_t>(tracks_[i].lost_until));
    for (const double value : {tracked_.x_mm[i], tracked_.y_mm[i], tracked_.vx_mm[i], tracked_.vy_mm[i],
                               shown_.x_mm[i], shown_.y_mm[i], shown_.heading_rad[i]})
      hash.add(hash_bits(value));
    hash.add(static_cast<std::uint64_t>(tracked_.led[i]) << 8 | static_cast<std::uint64_t>(shown_.led[i]));
  }
  return hash.finish();
}

void CameraModel::save(proto::CameraState& state) const {
  state.set_frame(frame_);
  save_shown(shown_, *state.mutable_shown(), *state.mutable_shown_led());
  for (const Track& track : tracks_) {
    state.add_follows(track.follows);
    state.add_lost_until(track.lost_until);
    for (const Place& place : track.positions) {
      state.add_positions(place.x);
      state.add_positions(place.y);
    }
    for (const Place& motion : track.motions) {
      state.add_motions(motion.x);
      state.add_motions(motion.y);
    }
    for (const LedClass colour : track.colours) state.mutable_led_classes()->push_back(static_cast<char>(colour));
    for (const std::size_t size : {track.positions.size(), track.motions.size(), track.colours.size()})
      state.add_buffered(static_cast<std::uint32_t>(size));
  }
  // The tracker's own picture first, then those that wait.
  state.add_waiting_frame(-1);
  save_shown(tracked_, *state.mutable_waiting(), *state.mutable_waiting_led());
  for (const Waiting& waiting : waiting_) {
    state.add_waiting_frame(waiting.frame);
    save_shown(waiting.seen, *state.mutable_waiting(), *state.mutable_waiting_led());
  }
}

void CameraModel::load(const proto::CameraState& state) {
  const std::size_t robots = tracks_.size(), frames = static_cast<std::size_t>(state.waiting_frame_size());
  const auto sized = [](int size, std::size_t right) { return static_cast<std::size_t>(size) == right; };
  bool fits = sized(state.shown_size(), robots * kShownColumns) && state.shown_led().size() == robots &&
              sized(state.follows_size(), robots) && sized(state.lost_until_size(), robots) &&
              sized(state.buffered_size(), 3 * robots) && frames > 0 &&
              sized(state.waiting_size(), frames * robots * kShownColumns) &&
              state.waiting_led().size() == frames * robots;
  std::size_t positions = 0, motions = 0, colours = 0;
  for (int i = 0; fits && i < state.buffered_size(); i += 3) {
    fits = state.buffered(i) <= kPositions && state.buffered(i + 1) <= kMotions &&
           state.buffered(i + 2) <= kColours && state.follows(i / 3) < robots;
    positions += state.buffered(i);
    motions += state.buffered(i + 1);
    colours += state.buffered(i + 2);
  }
  fits = fits && sized(state.positions_size(), 2 * positions) && sized(state.motions_size(), 2 * motions) &&
         state.led_classes().size() == colours;
  if (!fits) throw RunError("the checkpoint is of another camera; resume from another one");
  frame_ = state.frame();
  int position = 0, motion = 0;
  std::size_t colour = 0;
  for (std::size_t i = 0; i < robots; ++i) {
    const int at = static_cast<int>(i);
    Track& track = tracks_[i];
    track = {state.follows(at), state.lost_until(at), {}, {}, {}};
    for (std::uint32_t k = 0; k < state.buffered(3 * at); ++k, position += 2)
      track.positions.push_back({state.positions(position), state.positions(position + 1)});
    for (std::uint32_t k = 0; k < state.buffered(3 * at + 1); ++k, motion += 2)
      track.motions.push_back({state.motions(motion), state.motions(motion + 1)});
    for (std::uint32_t k = 0; k < state.buffered(3 * at + 2); ++k)
      track.colours.push_back(static_cast<LedClass>(state.led_classes()[colour++] & kClassMask));
  }
  shown_ = load_shown(state.shown(), 0, state.shown_led(), 0, robots);
  waiting_.clear();
  for (std::size_t i = 0; i < frames; ++i) {
    SeenRobots seen = load_shown(state.waiting(), static_cast<int>(i * robots) * kShownColumns, state.waiting_led(),
                                 i * robots, robots);
    if (i == 0)
      tracked_ = std::move(seen);
    else
      waiting_.push_back({state.waiting_frame(static_cast<int>(i)), std::move(seen)});
  }
}

}  // namespace kilotwin::ark
