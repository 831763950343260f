/// The demonstrations of docs/explanation/gallery.md, one function each: it runs the experiment and adds its measures.
#pragma once

#include "tests/validation/gallery/demo_run.hpp"
#include "tests/validation/verdicts.hpp"

namespace kilotwin::validation {

// One robot moves by the distance to others: moving_demos.cpp.
void show_orbit(const DemoSettings&, Verdicts&);
void show_edge_follow(const DemoSettings&, Verdicts&);
void show_disperse(const DemoSettings&, Verdicts&);
void show_phototaxis(const DemoSettings&, Verdicts&);
void show_follow(const DemoSettings&, Verdicts&);

// Robots stand still and talk: standing_demos.cpp.
void show_speaker_listener(const DemoSettings&, Verdicts&);
void show_gradient(const DemoSettings&, Verdicts&);
void show_leader_election(const DemoSettings&, Verdicts&);
void show_sync(const DemoSettings&, Verdicts&);
void show_firefly(const DemoSettings&, Verdicts&);
void show_morphogenesis(const DemoSettings&, Verdicts&);

}  // namespace kilotwin::validation
