#include "tests/identify/truth/scenarios.hpp"

#include <stdexcept>
#include <utility>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/effects.hpp"

namespace kilotwin::truth {
namespace {

// Laboratories: tracker, sampling, drive and arena.

/// Headings, low tracker noise, disc centres tracked.
Scene tidy_lab() { return {}; }

/// No headings; the tracker follows the point between the wheels.
Scene blind_lab() {
  Scene s;
  s.heading = false;
  s.tracked_ahead_mm = 0;
  s.tracker_sd_mm = 0.6;
  return s;
}

/// Irregular frames, many missing, gaps of 10 s, no headings.
Scene poor_lab() {
  Scene s;
  s.heading = false;
  s.jitter = 0.4;
  s.missing = 0.15;
  s.gap_share = 0.3;
  s.tracker_sd_mm = 0.8;
  return s;
}

/// A drive with its reference point at the disc centre, no walls, low noise.
Scene plain_lab() {
  Scene s;
  s.disc_ahead_mm = s.tracked_ahead_mm = 0;
  s.width_mm = s.height_mm = 0;
  s.factor_sd = 0.08;
  s.heading_sd_rad = 0.02;
  s.bias_sd_mm_s = 1.86;
  return s;
}

/// Many robots in a small arena.
Scene crowded_lab() {
  Scene s;
  s.robots = 24;
  s.width_mm = s.height_mm = 480;
  s.train_runs = 3;
  s.train_s = 150;
  s.test_s = 90;
  return s;
}

Scene with(Scene scene, std::vector<Effect> effects) {
  scene.effects = std::move(effects);
  return scene;
}

Scene with(Scene scene, std::vector<Fault> faults) {
  scene.faults = std::move(faults);
  return scene;
}

struct Entry {
  const char* name;
  const char* about;
  Scene (*make)();
};

using Effects = std::vector<Effect>;
using Faults = std::vector<Fault>;

const Entry kEntries[] = {
    // One per covariate, and look-alikes.
    {"noisy-robots", "noise: the speeds of some robots vary more",
     [] { return with(tidy_lab(), Effects{noisy_robots()}); }},
    {"rough-patch", "noise: speeds vary more on a part of the floor",
     [] { return with(tidy_lab(), Effects{rough_patch()}); }},
    {"battery", "time: a battery by the clock", [] { return with(tidy_lab(), Effects{battery_by_the_clock()}); }},
    {"fatigue", "motor_time: each motor tires by its own use",
     [] { return with(blind_lab(), Effects{fatigue_of_motors()}); }},
    {"left-motors", "motor_time: the left motors alone tire",
     [] { return with(tidy_lab(), Effects{fatigue_of_left_motors()}); }},
    {"brushes", "motor_time: motors are slow at once, after so much use",
     [] { return with(tidy_lab(), Effects{worn_brushes()}); }},
    {"start", "time_since_command: a motion starts slowly and overshoots",
     [] { return with(tidy_lab(), Effects{slow_start()}); }},
    {"patch", "position: a rough patch of floor", [] { return with(blind_lab(), Effects{slow_patch()}); }},
    {"warming-patch", "position and time: a patch of floor that gets warm",
     [] { return with(tidy_lab(), Effects{warming_patch()}); }},
    {"drying-patch", "position and time: a wet patch that dries",
     [] { return with(tidy_lab(), Effects{drying_patch()}); }},
    {"growing-grain", "heading and time: a floor that gets a grain",
     [] { return with(tidy_lab(), Effects{growing_grain()}); }},
    {"half-the-room", "position and robot: half of the robots are slow in half of the room",
     [] { return with(tidy_lab(), Effects{half_the_room()}); }},
    {"combed-half", "position and heading: half of the floor has a grain",
     [] { return with(tidy_lab(), Effects{combed_half()}); }},
    {"lamp", "position and time: a lamp is switched on", [] { return with(blind_lab(), Effects{lamp()}); }},
    {"fresh-batteries", "history: every run has batteries of its own",
     [] { return with(tidy_lab(), Effects{batteries_of_the_day()}); }},
    {"rim", "position: slower towards the rim, as through a lens",
     [] { return with(tidy_lab(), Effects{slower_outside()}); }},
    {"strip", "position: a strip of another floor, with straight edges",
     [] { return with(tidy_lab(), Effects{slow_strip()}); }},
    {"lens", "measurement: a lens", [] { return with(tidy_lab(), Effects{lens()}); }},
    {"pincushion-blind", "measurement: the other lens, no headings",
     [] { return with(blind_lab(), Effects{pincushion()}); }},
    {"keystone", "measurement: a camera that leans", [] { return with(tidy_lab(), Effects{keystone()}); }},
    {"scale-drift", "measurement and time: the picture grows slowly",
     [] { return with(tidy_lab(), Effects{growing_picture()}); }},
    {"mosaic", "measurement: pictures that do not match", [] { return with(plain_lab(), Effects{mosaic()}); }},
    {"camera", "measurement and time: the camera is bumped, and put right",
     [] { return with(tidy_lab(), Effects{camera_bump()}); }},
    {"knock", "world_frame and time: the table is knocked",
     [] { return with(tidy_lab(), Effects{table_knock()}); }},
    {"grain", "heading: a floor with a grain", [] { return with(poor_lab(), Effects{grain()}); }},
    {"tilt", "world_frame: a tilted table", [] { return with(blind_lab(), Effects{tilt()}); }},
    {"vortex", "world_frame and position: turning air", [] { return with(tidy_lab(), Effects{vortex()}); }},
    {"draught", "world_frame and time: a draught that comes and goes",
     [] { return with(plain_lab(), Effects{draught()}); }},
    {"slip", "command, not the room: robots going straight slip to their left",
     [] { return with(blind_lab(), Effects{side_slip()}); }},
    {"right", "command: weak right turns", [] { return with(tidy_lab(), Effects{weak_right()}); }},
    {"slow-robots", "robot, not the floor: some robots are slow",
     [] { return with(tidy_lab(), Effects{slow_robots()}); }},
    {"crowd", "neighbours: robots are slow among others", [] { return with(crowded_lab(), Effects{crowd()}); }},
    {"third", "neighbours: robots are slow among two or more, within a radius of no raster",
     [] {
       Scene s = with(crowded_lab(), Effects{third_of_a_party()});
       s.width_mm = s.height_mm = 560;
       return s;
     }},
    {"flight", "neighbours: robots turn away from the nearest",
     [] { return with(crowded_lab(), Effects{flight()}); }},
    {"ahead", "neighbours: robots are slow behind others",
     [] { return with(crowded_lab(), Effects{wait_behind()}); }},
    {"linger", "history: after a turn robots go on turning",
     [] { return with(plain_lab(), Effects{lingering_turn()}); }},
    {"breathless", "history: robots slow down since their last rest",
     [] { return with(blind_lab(), Effects{breathless()}); }},
    {"cable", "history: the more one wheel has run than the other, the more robots turn back",
     [] { return with(tidy_lab(), Effects{winding_cable()}); }},
    {"worn", "history: the floor is polished where robots have been",
     [] { return with(crowded_lab(), Effects{worn_floor()}); }},
    {"trodden", "history: the floor is pressed down at once, in small cells that begin elsewhere",
     [] {
       Scene s = with(tidy_lab(), Effects{trodden_floor()});
       s.spot_mm = 20;
       s.spot_corner = {7, -6};
       return s;
     }},
    {"build-up", "time_since_command: speed builds up over seconds after each command",
     [] { return with(tidy_lab(), Effects{build_up()}); }},
    {"inertia", "history and time_since_command: wheels follow their commands with a lag",
     [] { return with(tidy_lab(), Effects{inertia()}); }},
    {"trails", "history: robots are slow where another one has just been",
     [] {
       Scene s = with(crowded_lab(), Effects{fresh_trails()});
       s.width_mm = s.height_mm = 640;
       return s;
     }},
    {"failing", "robot and time: some robots are slow from some time on",
     [] { return with(tidy_lab(), Effects{robots_that_fail()}); }},
    {"waves", "position and time: stripes of slow floor travel",
     [] { return with(tidy_lab(), Effects{travelling_waves()}); }},
    {"fisheye", "measurement: a strong barrel distortion, straight headings",
     [] { return with(tidy_lab(), Effects{fisheye()}); }},
    {"fisheye-headings", "measurement: a strong barrel distortion, headings bent with it",
     [] { return with(tidy_lab(), Effects{fisheye_with_headings()}); }},
    {"knocked", "measurement and time: the camera is knocked in the middle of each run",
     [] {
       Scene s = with(tidy_lab(), Effects{camera_knock()});
       s.disc_ahead_mm = 0;
       s.tracked_ahead_mm = 0;
       return s;
     }},
    {"knocked-ahead", "the same with discs 9.2 mm ahead of the drive",
     [] { return with(tidy_lab(), Effects{camera_knock()}); }},
    {"failures", "robot and time: robots fail one after another",
     [] { return with(tidy_lab(), Effects{failures_in_turn()}); }},
    {"late-some", "robot, time and position: some robots, from some time on, in a part of the room",
     [] { return with(tidy_lab(), Effects{late_patch_of_some()}); }},
    {"veering", "robot and time: some robots veer from some time on",
     [] { return with(blind_lab(), Effects{veering_robots()}); }},
    {"boards", "position: boards that lie diagonally", [] { return with(tidy_lab(), Effects{boards()}); }},
    // Two effects at once.
    {"fatigue-lens", "motor_time and measurement",
     [] {
       return with(tidy_lab(), Effects{fatigue_of_motors(), lens()});
     }},
    {"creep-battery", "time and measurement",
     [] {
       return with(tidy_lab(), Effects{battery_by_the_clock(), creeping_camera()});
     }},
    {"patch-tilt", "position and world_frame",
     [] {
       return with(blind_lab(), Effects{slow_patch(), tilt()});
     }},
    {"grain-start", "heading and time_since_command",
     [] {
       return with(plain_lab(), Effects{grain(), slow_start()});
     }},
    {"battery-slow-robots", "time and robot",
     [] {
       return with(poor_lab(), Effects{battery_by_the_clock(), slow_robots()});
     }},
    // Near the noise level.
    {"faint-grain", "heading, a fifth as strong", [] { return with(tidy_lab(), Effects{grain(0.2)}); }},
    {"faint-battery", "time, a fifth as strong",
     [] { return with(tidy_lab(), Effects{battery_by_the_clock(0.2)}); }},
    {"faint-tilt", "world_frame, a fifth as strong", [] { return with(blind_lab(), Effects{tilt(0.2)}); }},
    // No effect, in every laboratory.
    {"nothing-tidy", "no effect", [] { return tidy_lab(); }},
    {"nothing-blind", "no effect", [] { return blind_lab(); }},
    {"nothing-poor", "no effect", [] { return poor_lab(); }},
    {"nothing-plain", "no effect", [] { return plain_lab(); }},
    {"nothing-crowded", "no effect", [] { return crowded_lab(); }},
    // Faults of the data.
    {"swapped", "robots 3 and 9 exchange their numbers in run 1",
     [] {
       return with(tidy_lab(), Faults{{Fault::Kind::kSwapped, 1, 3, 9, 88, 0, 0}});
     }},
    {"clock", "the tracker's clock runs at 1.15 times the true one in run 2",
     [] {
       return with(tidy_lab(), Faults{{Fault::Kind::kClock, 2, 0, 0, 0, 0, 1.15}});
     }},
    {"duplicate", "robot 5 is tracked twice in run 0, as 40 too",
     [] {
       return with(blind_lab(), Faults{{Fault::Kind::kDuplicate, 0, 5, 40, 0, 0, 0}});
     }},
    {"outliers", "1.5 % of the positions in run 0 are elsewhere",
     [] {
       return with(blind_lab(), Faults{{Fault::Kind::kOutliers, 0, 0, 0, 0, 0, 0.015}});
     }},
    {"frozen", "the tracker holds robot 2 from 60 to 110 s of run 0, robot 7 from 20 to 60 s of run 2",
     [] {
       return with(tidy_lab(),
                   Faults{{Fault::Kind::kFrozen, 0, 2, 0, 60, 110, 0}, {Fault::Kind::kFrozen, 2, 7, 0, 20, 60, 0}});
     }},
};

}  // namespace

std::vector<std::string> scenario_names() {
  std::vector<std::string> names;
  for (const Entry& entry : kEntries) names.emplace_back(entry.name);
  return names;
}

Scene scenario(const std::string& name) {
  for (const Entry& entry : kEntries) {
    if (name != entry.name) continue;
    Scene scene = entry.make();
    scene.name = entry.name;
    scene.about = entry.about;
    return scene;
  }
  throw std::invalid_argument("no scene '" + name + "'");
}

Scene nothing_to_find(std::uint64_t seed) {
  Dice dice(seed ^ 0x6e6f7468696e67);
  Scene s;
  s.name = "nothing-" + std::to_string(seed);
  s.about = "no effect";
  s.robots = 4 + dice.pick(7);
  s.train_runs = 1 + dice.pick(3);
  s.test_runs = 1;
  s.train_s = 10 * (6 + dice.pick(9));
  s.test_s = 60;
  s.width_mm = dice.uniform() < 0.3 ? 0 : dice.between(350, 1200);
  s.height_mm = s.width_mm * dice.between(0.6, 1);
  s.disc_ahead_mm = dice.uniform() < 0.3 ? 0 : 9.2;
  s.tracked_ahead_mm = dice.uniform() < 0.5 ? 0 : s.disc_ahead_mm;
  s.bias_sd_mm_s = dice.between(0.3, 2);
  s.factor_sd = dice.between(0.02, 0.25);
  s.step_s = dice.uniform() < 0.5 ? 0.1 : 0.05;
  s.sample_s = dice.uniform() < 0.5 ? 0.5 : dice.uniform() < 0.5 ? 0.25 : 1;
  s.jitter = dice.uniform() < 0.5 ? 0 : 0.4;
  s.missing = dice.uniform() < 0.5 ? 0 : dice.between(0, 0.2);
  s.gap_share = dice.uniform() < 0.5 ? 0 : 0.3;
  s.tracker_sd_mm = dice.between(0.1, 1.2);
  s.heading = dice.uniform() < 0.5;
  s.heading_sd_rad = dice.between(0.01, 0.1);
  return s;
}

}  // namespace kilotwin::truth
