#include "clients/recorder/tracker_records.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::recorder {

bool has_equal_columns(const TrackerSample& sample) {
  for (const std::size_t size :
       {sample.state.size(), sample.x.size(), sample.y.size(), sample.heading_rad.size(), sample.xx.size(),
        sample.xy.size(), sample.yy.size(), sample.heading_variance_rad2.size(), sample.led.size()}) {
    if (size != sample.robot.size()) return false;
  }
  return true;
}

proto::TrackerRecord to_record(Tick tick, const TrackerSample& sample) {
  proto::TrackerRecord record;
  record.set_tick(tick.count());
  record.set_source(sample.source);
  record.set_frame(sample.frame);
  record.set_capture_cycle(sample.capture_cycle);
  record.mutable_robot()->Add(sample.robot.begin(), sample.robot.end());
  record.mutable_state()->assign(sample.state.begin(), sample.state.end());
  record.mutable_x()->Add(sample.x.begin(), sample.x.end());
  record.mutable_y()->Add(sample.y.begin(), sample.y.end());
  record.mutable_heading_rad()->Add(sample.heading_rad.begin(), sample.heading_rad.end());
  record.mutable_xx()->Add(sample.xx.begin(), sample.xx.end());
  record.mutable_xy()->Add(sample.xy.begin(), sample.xy.end());
  record.mutable_yy()->Add(sample.yy.begin(), sample.yy.end());
  record.mutable_heading_variance_rad2()->Add(sample.heading_variance_rad2.begin(),
                                              sample.heading_variance_rad2.end());
  record.mutable_led()->assign(sample.led.begin(), sample.led.end());
  for (const HeardMessage& heard : sample.heard) {
    record.add_heard_robot(heard.robot);
    record.add_heard_listener(heard.listener);
    record.add_heard_distance_mm(heard.distance_mm);
    record.mutable_heard_message()->append(heard.message.begin(), heard.message.end());
  }
  return record;
}

TrackerSample from_record(const proto::TrackerRecord& record) {
  TrackerSample sample;
  sample.source = record.source();
  sample.frame = record.frame();
  sample.capture_cycle = record.capture_cycle();
  sample.robot.assign(record.robot().begin(), record.robot().end());
  sample.state.assign(record.state().begin(), record.state().end());
  sample.x.assign(record.x().begin(), record.x().end());
  sample.y.assign(record.y().begin(), record.y().end());
  sample.heading_rad.assign(record.heading_rad().begin(), record.heading_rad().end());
  sample.xx.assign(record.xx().begin(), record.xx().end());
  sample.xy.assign(record.xy().begin(), record.xy().end());
  sample.yy.assign(record.yy().begin(), record.yy().end());
  sample.heading_variance_rad2.assign(record.heading_variance_rad2().begin(), record.heading_variance_rad2().end());
  sample.led.assign(record.led().begin(), record.led().end());
  const int messages = record.heard_robot_size();
  if (record.heard_listener_size() != messages || record.heard_distance_mm_size() != messages ||
      record.heard_message().size() != static_cast<std::size_t>(messages) * IrMessage{}.size()) {
    throw UserError(fmt::format("the recorded messages of listeners of tick {} are damaged", record.tick()));
  }
  for (int i = 0; i < messages; ++i) {
    HeardMessage heard{record.heard_robot(i), record.heard_listener(i), record.heard_distance_mm(i), {}};
    std::copy_n(record.heard_message().begin() + static_cast<std::ptrdiff_t>(i) * 10, 10, heard.message.begin());
    sample.heard.push_back(heard);
  }
  if (!has_equal_columns(sample))
    throw UserError(fmt::format("the recorded tracker sample of tick {} is damaged: its columns differ in length",
                                record.tick()));
  return sample;
}

}  // namespace kilotwin::recorder
