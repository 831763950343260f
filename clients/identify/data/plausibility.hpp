/// Plausibility of a measured set: wrong units, commands without robots, robots without motion. Checked before the
/// fit.
#pragma once

#include <string>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Throws UserError, with the remedy, if
///   - times are not seconds since the start of the run (an epoch, milliseconds, frames), or a run is many recordings;
///   - positions are not mm (metres, centimetres, pixels), or headings not radians;
///   - nearly all turns go against the commands: y points down;
///   - headings of robots that drive straight are clockwise, or turned by more than 60 degrees from their motion;
///   - no robot is commanded to move while it is tracked, or no commanded robot moves.
/// `from` is the directory, for the message.
void demand_plausible(const MeasuredSet&, const std::string& from);

/// Throws UserError if no track to be predicted is longer than the horizon. `held_out_only`: counts held-out
/// tracks only.
void demand_longer_than(const MeasuredSet&, double horizon_s, bool held_out_only, const std::string& from);

}  // namespace kilotwin::identify
