/// Follower: from the robots of single frames to tracks over time. Knows no pictures; lengths are mm, y points up.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clients/track/body_pattern.hpp"
#include "clients/track/heading_filter.hpp"
#include "clients/track/led.hpp"
#include "clients/track/led_bearing.hpp"
#include "clients/track/position_filter.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::track {

/// A robot in one frame.
struct Sighting {
  double x_mm = 0, y_mm = 0;
  Covariance error = Covariance::round(0.2);  ///< of the position, mm^2
  Led led = Led::kOff;
  std::optional<double> led_bearing_rad;  ///< from the centre, anticlockwise from x
  std::optional<BodyPicture> body{};      ///< where the LED is dark
  bool led_clear = false;                 ///< LedReading::clear
};

/// As in TrackerFrame of idl/public.idl.
enum class TrackState : std::uint8_t { kSeen = 0, kPredicted = 1, kLost = 2, kDoubt = 3 };

struct Track {
  explicit Track(const PositionFilter& filter) : position(filter) {}

  std::uint32_t id = 0;  ///< counts up from 0 in the order in which tracks were confirmed
  TrackState state = TrackState::kSeen;
  PositionFilter position;
  HeadingFilter heading_filter;
  std::optional<std::size_t> sighting;  ///< of the last frame, where it was seen in it
  Led led = Led::kOff;                  ///< the last class that was clear, or was read twice in sequence
  double seen_s = 0;                    ///< when it was seen last
  bool doubt = false;                   ///< it may have exchanged its identity with another track
  bool confirmed = false;

  /// On the floor; nothing until it has moved, or has shown its heading.
  [[nodiscard]] std::optional<Heading> heading() const;

  // Only the follower uses these.
  StraightPath path;
  bool shows_heading = false;     ///< its heading rests on its LED or body, and not on a straight path since
  std::optional<Led> led_read{};  ///< of the last picture
  int frames = 0, hits = 0;       ///< while it is not confirmed
};

struct FollowLimits {
  double robot_radius_mm = kRobotRadius_mm;
  double predict_s = 0.5;  ///< a track not seen for longer is lost
  double forget_s = 30;    ///< a lost track is given up
  /// The direction of the LEDs from the robots' headings, where it is known; otherwise it is learned.
  std::optional<double> led_from_heading_rad{};
};

class Follower {
 public:
  explicit Follower(FollowLimits limits = {});

  /// Moves all tracks to the time of the next frame.
  void predict(double time_s);
  /// How far a track's robot may be from the predicted position, mm.
  [[nodiscard]] double reach_mm(const Track& track) const;
  /// Takes the sightings of the frame. Those that belong to no track begin one; it is confirmed when it was seen in
  /// three of five frames. The robots of the first frame are confirmed at once.
  void update(const std::vector<Sighting>& sightings);

  /// All tracks, those that are not confirmed included; ascending ids.
  [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }
  [[nodiscard]] const LedBearing& led_bearing() const { return led_bearing_; }
  /// How often tracks came into doubt.
  [[nodiscard]] std::uint64_t doubts() const { return doubts_; }
  /// An identification settled who a track is.
  void clear_doubt(std::uint32_t id);

 private:
  /// A heading that the robot shows by itself, at rest too.
  struct ShownHeading {
    double heading_rad, sd_rad;
  };
  void take(Track& track, std::size_t index, const Sighting& sighting);
  [[nodiscard]] std::optional<ShownHeading> shown_heading(const Track& track, const Sighting& sighting);
  static std::optional<ShownHeading> heading_of(LedBearing& mounted, double bearing_rad,
                                                const std::optional<double>& driven_rad);
  void miss(Track& track) const;
  void begin(std::size_t index, const Sighting& sighting);

  FollowLimits limits_;
  double time_s_ = 0;
  bool first_ = true;
  std::uint32_t next_id_ = 0;
  std::vector<Track> tracks_;
  LedBearing led_bearing_;
  BodyPattern pattern_;
  LedBearing pattern_bearing_;  ///< how well the pattern's headings agree with those of paths
  std::uint64_t doubts_ = 0;
};

}  // namespace kilotwin::track
