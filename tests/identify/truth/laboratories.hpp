/// Laboratories: tracker, sampling, drive and arena of scenes, without effects.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

Scene tidy_lab();     // headings, low tracker noise, disc centres tracked
Scene blind_lab();    // no headings; the tracker follows the point between the wheels
Scene poor_lab();     // irregular frames, many missing, gaps of 10 s, no headings
Scene plain_lab();    // a drive with its reference point at the disc centre, no walls, low noise
Scene crowded_lab();  // many robots in a small arena
Scene brisk_lab();    // 4 frames a second with headings, irregular
Scene sparse_lab();   // 1 frame a second, no headings, an oblong arena
Scene small_lab();    // five robots, one frame a second, four runs, gaps
Scene late_lab();     // commands are stamped 0.4 s late

}  // namespace kilotwin::truth
