#include "tests/identify/truth/scenarios.hpp"

#include <stdexcept>
#include <utility>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/effects.hpp"
#include "tests/identify/truth/laboratories.hpp"
#include "tests/identify/truth/laboratory_effects.hpp"
#include "tests/identify/truth/random_effects.hpp"

namespace kilotwin::truth {
namespace {

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
    {"other-floor", "position: another floor beyond an oblique line, and a smooth bump",
     [] { return with(tidy_lab(), Effects{other_floor()}); }},
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
    // Suspicions of engineers, in laboratories of all kinds.
    {"backlash", "history: the play of the gears when the direction of turning changes",
     [] { return with(brisk_lab(), Effects{backlash()}); }},
    {"stiction", "history: robots start late after a long rest",
     [] {
       Scene s = with(brisk_lab(), Effects{stiction()});
       s.stop_share = 0.3;
       return s;
     }},
    {"warm-turns", "history: turns are faster after a long drive ahead",
     [] { return with(tidy_lab(), Effects{warm_turns()}); }},
    {"shared-current", "command: the left wheel is weak while both motors run",
     [] { return with(sparse_lab(), Effects{shared_current()}); }},
    {"many-commands", "history: turns are weak after so many commands",
     [] { return with(tidy_lab(), Effects{many_commands()}); }},
    {"low-battery", "motor_time: speed holds, then falls",
     [] { return with(small_lab(), Effects{low_battery()}); }},
    {"thermal-wave", "history and time: the temperature of the day, which runs meet at different hours",
     [] { return with(tidy_lab(), Effects{thermal_wave()}); }},
    {"gusts", "world_frame and time: gusts that repeat", [] { return with(tidy_lab(), Effects{gusts()}); }},
    {"gusts-blind", "the same, with one frame a second and no headings",
     [] { return with(sparse_lab(), Effects{gusts()}); }},
    {"rising-noise", "noise: speeds vary more and more", [] { return with(tidy_lab(), Effects{rising_noise()}); }},
    {"crowd-noise", "noise: speeds vary more near other robots",
     [] { return with(tidy_lab(), Effects{crowd_noise()}); }},
    {"bowl", "world_frame and position: the floor sags", [] { return with(poor_lab(), Effects{bowl()}); }},
    {"drawing-walls", "world_frame and position: robots are drawn to two walls",
     [] {
       Scene s = with(tidy_lab(), Effects{drawing_walls()});
       s.width_mm = s.height_mm = 880;  // in the small size the walls are at +-330 mm
       return s;
     }},
    {"two-patches", "position: one patch slows, the other speeds up",
     [] { return with(blind_lab(), Effects{two_patches()}); }},
    {"outer-turn", "position: robots turn beyond a distance from the middle",
     [] { return with(tidy_lab(), Effects{outer_turn()}); }},
    {"moving-shadow", "position and time: a shadow crosses the arena",
     [] { return with(tidy_lab(), Effects{moving_shadow()}); }},
    {"growing-puddle", "position and time: a wet spot spreads",
     [] { return with(blind_lab(), Effects{growing_puddle()}); }},
    {"patch-of-some-more", "position and robot: a patch slows each robot by another amount",
     [] { return with(tidy_lab(), Effects{patch_of_some_more()}); }},
    {"replaced-robots", "robot and time: two robots are replaced during each run",
     [] { return with(tidy_lab(), Effects{replaced_robots()}); }},
    {"driving-crowd", "neighbours: robots are slow among others that drive",
     [] { return with(crowded_lab(), Effects{driving_crowd()}); }},
    {"slow-leader", "neighbours and robot: robots near robot 0 are slow",
     [] { return with(crowded_lab(), Effects{slow_leader()}); }},
    {"bent-headings", "measurement: measured headings are off, by place",
     [] { return with(tidy_lab(), Effects{bent_headings()}); }},
    {"parallax", "measurement and robot: tall robots under a low camera",
     [] { return with(tidy_lab(), Effects{parallax()}); }},
    {"backlash-battery", "history and time, commands stamped late",
     [] {
       return with(late_lab(), Effects{backlash(), battery_by_the_clock()});
     }},
    {"bowl-patches", "world_frame and position, in an oblong arena",
     [] {
       return with(sparse_lab(), Effects{bowl(), two_patches()});
     }},
    {"gusts-replaced", "world_frame and time, robot and time",
     [] {
       Scene s = with(small_lab(), Effects{gusts(), replaced_robots()});
       s.robots = 6;
       return s;
     }},
    {"thermal-shadow", "history and time, position and time",
     [] {
       return with(brisk_lab(), Effects{thermal_wave(), moving_shadow()});
     }},
    {"leader-puddle", "neighbours, position and time",
     [] {
       return with(crowded_lab(), Effects{slow_leader(), growing_puddle()});
     }},
    {"current-stiction", "command, history",
     [] {
       return with(poor_lab(), Effects{shared_current(), stiction()});
     }},
    {"stalls", "no effect that can be known: motors stall at random",
     [] { return with(tidy_lab(), Effects{stalls()}); }},
    {"rare-stalls", "motors stall at random, once a minute, with rare long spells",
     [] { return with(tidy_lab(), Effects{rare_spells({})}); }},
    {"rare-slips", "the same, one frame a second and no headings: wheels slip to 40 % of their speed",
     [] {
       return with(sparse_lab(), Effects{rare_spells({45, 9, 3, 0.4})});
     }},
    {"stalls-battery", "time, and motors that stall at random",
     [] {
       return with(blind_lab(), Effects{rare_spells({}), battery_by_the_clock()});
     }},
    {"stalls-patch", "position, and motors that stall at random",
     [] {
       return with(tidy_lab(), Effects{stalls(), slow_patch()});
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
    {"nothing-brisk", "no effect", [] { return brisk_lab(); }},
    {"nothing-sparse", "no effect", [] { return sparse_lab(); }},
    {"nothing-few", "no effect", [] { return small_lab(); }},
    {"nothing-late", "no effect, commands stamped late", [] { return late_lab(); }},
    {"nothing-coarse", "no effect, one position in 25 with eight times the noise",
     [] {
       Scene s = tidy_lab();
       s.coarse = 0.04;
       return s;
     }},
    {"nothing-heavy", "no effect, noise with a heavy tail",
     [] { return with(tidy_lab(), Effects{heavy_tailed_noise()}); }},
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
  if (name.starts_with("nothing:")) return nothing_to_find(std::stoull(name.substr(8)));
  if (name.starts_with("random:")) return random_effects(std::stoull(name.substr(7)));
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
