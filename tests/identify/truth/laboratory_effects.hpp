/// Further effects of the test data, chosen without a look at the identification: suspicions of an engineer in a laboratory.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

// Commands and their history.
Effect backlash();        // a turn against the last one begins with the play of the gears
Effect stiction();        // the longer the rest, the later a robot starts
Effect warm_turns();      // turns after a long drive ahead are faster
Effect shared_current();  // the left wheel is weak while both motors run
Effect many_commands();   // from the 21st command on, turns are weak

// Time and motor-on time.
Effect low_battery();   // speed holds until both motors have run for long enough, then falls
Effect thermal_wave();  // temperature over the day; runs begin at different times
Effect gusts();         // a gust that repeats with a period
Effect rising_noise();  // wheels vary more and more

// Place.
Effect bowl();            // vibrating robots slide to the middle of a floor that sags
Effect drawing_walls();   // robots near a wall are drawn to it
Effect two_patches();     // one patch slows, the other speeds up
Effect outer_turn();      // robots turn beyond a distance from the middle
Effect moving_shadow();   // a shadow crosses the arena
Effect growing_puddle();  // a wet spot that spreads

// Robots.
Effect patch_of_some_more();  // a patch that slows each robot by another amount
Effect replaced_robots();     // two robots are replaced during each run
Effect driving_crowd();       // robots are slow among others that drive
Effect slow_leader();         // robots near robot 0 are slow
Effect crowd_noise();         // wheels vary more among other robots

// Measurement.
Effect bent_headings();  // measured headings are off, by place
Effect parallax();       // tall robots are seen farther from the camera's foot

/// Chance events: motors stall for some seconds. The oracle does not know them.
Effect stalls();
/// The same as a renewal process: exponential times from one spell to the next, Lomax durations.
struct RareSpells {
  double mean_apart_s = 60, scale_s = 6, tail = 2.5;
  double speed = 0;  ///< factor within a spell
};
Effect rare_spells(RareSpells);
/// The standard deviation of each step's noise has a heavy tail. No mean depends on anything.
Effect heavy_tailed_noise();

}  // namespace kilotwin::truth
