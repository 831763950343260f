/// Conversion between engines' frames and DDS samples. to_wire() borrows the frame's arrays. from_wire() copies into the frame's
/// arrays and reuses their capacity. It refuses a sample whose arrays differ in length. frame_check.hpp compares the frame with
/// the plan.
#pragma once

#include "core/federation/schedule.hpp"
#include "core/federation/topics.hpp"
#include "core/frames/frames.hpp"

namespace kilotwin {

/// Fields of every sample besides the tick.
struct WireHeader {
  std::uint32_t publisher;
  std::uint64_t run;
  std::uint32_t directives;
};

// The results point into `frame` and live no longer than it.
WireBodyFrame to_wire(const WireHeader&, const BodyFrame& frame);
WireActuationFrame to_wire(const WireHeader&, const ActuationFrame& frame);
WireRadioFrame to_wire(const WireHeader&, const RadioFrame& frame);
WireOverheadFrame to_wire(const WireHeader&, const OverheadFrame& frame);
WireTrackingFrame to_wire(const WireHeader&, const TrackingFrame& frame);
WireDirective to_wire(std::uint64_t run, const Directive& directive);

// Returns false if the sample is malformed; the frame is then unspecified.
bool from_wire(const WireBodyFrame&, BodyFrame& frame);
bool from_wire(const WireActuationFrame&, ActuationFrame& frame);
bool from_wire(const WireRadioFrame&, RadioFrame& frame);
bool from_wire(const WireOverheadFrame&, OverheadFrame& frame);
bool from_wire(const WireTrackingFrame&, TrackingFrame& frame);
bool from_wire(const WireDirective&, Directive& directive);

/// The wire type of a frame.
template <class Frame> struct WireOf;
template <> struct WireOf<BodyFrame> { using Type = WireBodyFrame; };
template <> struct WireOf<ActuationFrame> { using Type = WireActuationFrame; };
template <> struct WireOf<RadioFrame> { using Type = WireRadioFrame; };
template <> struct WireOf<TrackingFrame> { using Type = WireTrackingFrame; };
template <> struct WireOf<OverheadFrame> { using Type = WireOverheadFrame; };

}  // namespace kilotwin
