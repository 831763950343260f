/// Effects of the test data: bells, powers, saw-teeth and other shapes. `strength` 1 is what a careless lab has.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

// Of time and use.
Effect battery_by_the_clock(double strength = 1);    // all wheels slow down with the time of day
Effect fatigue_of_motors(double strength = 1);       // each wheel slows down as its own motor is used
Effect fatigue_of_left_motors(double strength = 1);  // left wheels alone do so
Effect worn_brushes(double strength = 1);            // at once, after so much use
Effect slow_start(double strength = 1);              // a motion begins slowly, overshoots, settles

// Of place and direction.
Effect slow_patch(double strength = 1);      // an oval patch of rough floor
Effect slower_outside(double strength = 1);  // speed falls towards the rim: what a lens seems to do
Effect slow_strip(double strength = 1);      // a strip of another floor, across the room
Effect grain(double strength = 1);           // the floor is slower against its grain
Effect vortex(double strength = 1);          // air turns about a point of the room
Effect warming_patch(double strength = 1);   // a patch that gets warm, and slow, within the first minutes
Effect lamp(double strength = 1);            // robots are faster in a part of the room once it is lit
Effect drying_patch(double strength = 1);    // a wet patch of floor that dries
Effect growing_grain(double strength = 1);   // the floor gets a grain, in the course of a run
Effect half_the_room(double strength = 1);   // half of the robots are slow in half of the room
Effect tilt(double strength = 1);            // vibrating robots slide down a tilted table
Effect draught(double strength = 1);         // a draught that comes and goes moves all robots, stopped ones too
Effect table_knock(double strength = 1);     // vibrating robots slide when the table is knocked

// Of runs.
Effect batteries_of_the_day(double strength = 1);  // every run has another speed

// Of robots.
Effect slow_robots(double strength = 1);       // every third robot is slow, wherever it is
Effect crowd(double strength = 1);             // robots are slow among others
Effect third_of_a_party(double strength = 1);  // robots are slow among two or more others
Effect flight(double strength = 1);            // robots turn away from the nearest other
Effect wait_behind(double strength = 1);       // robots are slow behind others

// Of what they are told, and were told.
Effect weak_right(double strength = 1);      // right turns are slow and slip backwards
Effect side_slip(double strength = 1);       // robots that go straight slip to their left
Effect lingering_turn(double strength = 1);  // after a turn robots go on turning
Effect breathless(double strength = 1);      // the longer since the last rest, the slower
Effect winding_cable(double strength = 1);   // what one wheel has run more than the other turns a robot back
Effect worn_floor(double strength = 1);      // the floor is polished where robots have been
Effect trodden_floor(double strength = 1);   // the floor is pressed down at once where robots have been

// Of the tracker.
Effect lens(double strength = 1);             // a barrel distortion
Effect pincushion(double strength = 1);       // the opposite, of a lens that is no polynomial
Effect keystone(double strength = 1);         // a camera that looks at the floor askew
Effect growing_picture(double strength = 1);  // the camera sinks slowly
Effect creeping_camera(double strength = 1);  // the camera turns aside, ever more slowly
Effect camera_bump(double strength = 1);      // the camera is pushed aside, and put right later
Effect mosaic(double strength = 1);           // cameras whose pictures do not match

}  // namespace kilotwin::truth
