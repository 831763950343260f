/// The picture that ARK's cameras and tracker give of the robots. Pure: frames are a function of the swarm at their exposure and of the
/// model's state. docs/explanation/station-camera.md has the equations.
///
/// A frame is exposed every 1/rate and shown a latency later; the first one is shown at once. Per frame:
/// - the whole frame may be dropped;
/// - a robot's position gets normal noise along x and y;
/// - its velocity is the mean of its last two positions less the mean of the first two of six, over the time between these
///   means, then averaged over the last five values, the newest with the largest weight;
/// - its heading is the direction of that velocity, and stays where there is none;
/// - its LED's class may be mistaken for another; the most frequent class of five frames is shown, of several the lowest;
/// - the tracker may lose it for a while: its state then does not change, and its buffers are cleared;
/// - a tracked robot that is absent is as good as lost;
/// - two robots that are seen close to each other may change identities.
#pragma once

#include <array>
#include <deque>

#include "core/effects/measurement.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "core/plan/station_settings.hpp"
#include "core/random/random.hpp"
#include "services/ark/seen_robots.hpp"

namespace kilotwin::proto {
class CameraState;
}

namespace kilotwin::ark {

class CameraModel {
 public:
  CameraModel(const RunPlan&, const CameraSettings&);

  /// Exposes and shows the frames that are due at the swarm's tick. `measured`: poses with the effects on what is measured, or
  /// nullptr where there are none. Ticks ascend from 0, or from that of load().
  void step(const SwarmView& swarm, const MeasuredPoses* measured);
  /// The robots as the station sees them at present.
  [[nodiscard]] const SeenRobots& shown() const { return shown_; }
  /// The robot that the tracker follows under number `track`.
  [[nodiscard]] std::uint32_t follows(std::uint32_t track) const { return tracks_[track].follows; }

  [[nodiscard]] std::uint64_t word() const;
  void save(proto::CameraState&) const;
  /// Throws RunError where the state is of another experiment.
  void load(const proto::CameraState&);

 private:
  static constexpr std::size_t kPositions = 6, kMotions = 5, kColours = 5;  // depths of ARK's buffers
  struct Place {
    double x, y;
  };
  struct Track {
    std::uint32_t follows = 0;
    std::int64_t lost_until = 0;  ///< the frame in which it is found again
    std::vector<Place> positions, motions;
    std::vector<LedClass> colours;
  };

  void expose(const SwarmView&, const MeasuredPoses*);
  void see(std::uint32_t track, Place truth, std::uint8_t led);
  void lose(std::uint32_t track);
  void forget(std::uint32_t track);
  void exchange_identities();
  [[nodiscard]] Tick exposed_at(std::int64_t frame) const;
  [[nodiscard]] Tick shown_at(std::int64_t frame) const;

  const TickLength tick_length_;
  const CameraSettings setting_;
  const Random random_;
  std::int64_t frame_ = 0;  ///< the next one
  std::vector<Track> tracks_;
  SeenRobots tracked_;  ///< of the last frame that was exposed
  struct Waiting {
    std::int64_t frame;
    SeenRobots seen;
  };
  std::deque<Waiting> waiting_;  ///< exposed and not yet shown, oldest first
  SeenRobots shown_;
};

}  // namespace kilotwin::ark
