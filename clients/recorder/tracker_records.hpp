/// Samples of trackers as records of a recording.
#pragma once

#include "core/base/time.hpp"
#include "core/frames/tracker_sample.hpp"

namespace kilotwin {
namespace proto {
class TrackerRecord;
}

namespace recorder {

/// Whether each column has one entry per robot.
[[nodiscard]] bool has_equal_columns(const TrackerSample& sample);

[[nodiscard]] proto::TrackerRecord to_record(Tick tick, const TrackerSample& sample);
/// Throws UserError where the record is damaged.
[[nodiscard]] TrackerSample from_record(const proto::TrackerRecord& record);

}  // namespace recorder
}  // namespace kilotwin
