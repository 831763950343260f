/// Effects of the test data: bells, powers, saw-teeth and other shapes. `strength` 1 is that of a careless lab.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

// Time and motor-on time.
Effect noisy_robots();                               // every third robot's wheels vary more
Effect rough_patch();                                // wheels vary more on a part of the floor
Effect battery_by_the_clock(double strength = 1);    // all wheels slow down with run time
Effect fatigue_of_motors(double strength = 1);       // each wheel slows down with its motor-on time
Effect fatigue_of_left_motors(double strength = 1);  // the same for left wheels only
Effect worn_brushes(double strength = 1);            // a step after a certain motor-on time
Effect slow_start(double strength = 1);              // a motion starts slowly, overshoots, settles

// Position and direction.
Effect slow_patch(double strength = 1);        // an oval patch of rough floor
Effect slower_outside(double strength = 1);    // speed falls towards the boundary, similar to a lens
Effect slow_strip(double strength = 1);        // a strip of another floor across the arena
Effect other_floor(double strength = 1);       // another floor beyond an oblique line, beside a smooth bump
Effect grain(double strength = 1);             // the floor is slower against its grain
Effect vortex(double strength = 1);            // air rotates about a point of the arena
Effect warming_patch(double strength = 1);     // a patch becomes warm and slow within the first minutes
Effect lamp(double strength = 1);              // robots are faster in a part of the arena once it is lit
Effect drying_patch(double strength = 1);      // a wet patch of floor that dries
Effect growing_grain(double strength = 1);     // the floor develops a grain during a run
Effect half_the_room(double strength = 1);     // half of the robots are slow in half of the arena
Effect combed_half(double strength = 1);       // half of the floor has a grain
Effect travelling_waves(double strength = 1);  // stripes of slow floor travel over the arena
Effect tilt(double strength = 1);              // vibrating robots slide down a tilted table
Effect draught(double strength = 1);           // an intermittent draught moves all robots, also at rest
Effect table_knock(double strength = 1);       // vibrating robots slide when the table is knocked

// Runs.
Effect batteries_of_the_day(double strength = 1);  // every run has another speed

// Robots.
Effect slow_robots(double strength = 1);       // every third robot is slow everywhere
Effect robots_that_fail(double strength = 1);  // every third robot is slow from some time on
Effect crowd(double strength = 1);             // robots are slow among others
Effect third_of_a_party(double strength = 1);  // robots are slow among two or more others
Effect flight(double strength = 1);            // robots turn away from the nearest other robot
Effect wait_behind(double strength = 1);       // robots are slow behind others

// Commands and their history.
Effect weak_right(double strength = 1);      // right turns are slow and slip backwards
Effect side_slip(double strength = 1);       // robots that drive straight slip to their left
Effect lingering_turn(double strength = 1);  // after a turn robots continue to turn
Effect breathless(double strength = 1);      // the longer since the last rest, the slower
Effect build_up(double strength = 1);        // speed builds up over seconds after each command
Effect inertia(double strength = 1);         // wheel speeds follow the command with a lag, also to rest
Effect fresh_trails(double strength = 1);    // robots are slow where another one has just been
Effect winding_cable(double strength = 1);   // the difference of the motor-on times turns a robot back
Effect worn_floor(double strength = 1);      // driven time polishes the floor
Effect trodden_floor(double strength = 1);   // driven time compresses the floor, at once

// Measurement.
Effect lens(double strength = 1);                   // a barrel distortion
Effect pincushion(double strength = 1);             // the opposite distortion, not a polynomial
Effect fisheye(double strength = 1);                // a barrel distortion of 14 % at the walls
Effect fisheye_with_headings(double strength = 1);  // the same; measured headings are bent with the picture
Effect camera_knock(double strength = 1);           // the camera is knocked, and stays so
Effect keystone(double strength = 1);               // a camera with an oblique view of the floor
Effect growing_picture(double strength = 1);        // the camera sinks slowly
Effect creeping_camera(double strength = 1);        // the camera rotates, ever more slowly
Effect camera_bump(double strength = 1);            // the camera is displaced, and restored later
Effect mosaic(double strength = 1);                 // cameras with mosaic seams

// Of several covariates.
Effect failures_in_turn(double strength = 1);    // robots become slow one after another
Effect veering_robots(double strength = 1);      // every third robot turns to one side from some time on
Effect late_patch_of_some(double strength = 1);  // some robots are slow, from some time on, in half of the arena
Effect boards(double strength = 1);              // boards that lie diagonally, finer than the maps resolve

}  // namespace kilotwin::truth
