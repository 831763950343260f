/// What of a set cannot be as it is meant: other units, commands for nobody, nobody who moves. Told in words before anything is fitted.
#pragma once

#include <string>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Throws UserError, with what would be right, where
///   - times are no seconds since the start of a run (an epoch, milliseconds, frames);
///   - positions are no mm (metres, pixels), headings no radians;
///   - nobody is told to move while it is seen, or nobody moves who is told to.
/// `from` is the directory, as the error names it.
void demand_plausible(const MeasuredSet&, const std::string& from);

/// Throws UserError where no track to be predicted lasts longer than the horizon. `held_out_only`: of those held out.
void demand_longer_than(const MeasuredSet&, double horizon_s, bool held_out_only, const std::string& from);

}  // namespace kilotwin::identify
