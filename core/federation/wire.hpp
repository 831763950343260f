/// Between engines' frames and DDS samples. Writing borrows the frame's arrays; reading copies into the frame's, whose
/// capacity is reused. A sample whose arrays disagree in length is refused: it did not come from us. Whether it fits the
/// plan is for frame_check.hpp to say.
#pragma once

#include "core/federation/schedule.hpp"
#include "core/federation/topics.hpp"
#include "core/frames/frames.hpp"

namespace kilotwin {

/// The fields that every frame has on the wire besides its tick.
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
WireDirective to_wire(std::uint64_t run, const Directive& directive);

// False where the sample is malformed; the frame is then unspecified.
bool from_wire(const WireBodyFrame&, BodyFrame& frame);
bool from_wire(const WireActuationFrame&, ActuationFrame& frame);
bool from_wire(const WireRadioFrame&, RadioFrame& frame);
bool from_wire(const WireOverheadFrame&, OverheadFrame& frame);
bool from_wire(const WireDirective&, Directive& directive);

/// The wire type of a frame.
template <class Frame> struct WireOf;
template <> struct WireOf<BodyFrame> { using Type = WireBodyFrame; };
template <> struct WireOf<ActuationFrame> { using Type = WireActuationFrame; };
template <> struct WireOf<RadioFrame> { using Type = WireRadioFrame; };
template <> struct WireOf<OverheadFrame> { using Type = WireOverheadFrame; };

}  // namespace kilotwin
