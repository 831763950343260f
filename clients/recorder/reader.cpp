#include "clients/recorder/reader.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

constexpr std::size_t kBlock_bytes = 1 << 20;
/// Upper bound of ticks: 1e6 s of the shortest tick are 2.5e8, and products with doubles are exact below 2^53.
constexpr std::int64_t kLastTick = std::int64_t{1} << 40;

std::uint32_t get_u32(std::span<const std::uint8_t> from) {
  return from[0] | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16 | std::uint32_t{from[3]} << 24;
}

bool in_range(double value, double low, double high) { return value >= low && value <= high; }  // false for NaN

bool all_within(const google::protobuf::RepeatedField<double>& values, double bound) {
  return std::all_of(values.begin(), values.end(),
                     [bound](double value) { return in_range(value, -bound, bound); });
}

bool valid_tick(std::int64_t tick) { return tick >= 0 && tick <= kLastTick; }

/// Whether walls and bodies have shapes that can be drawn.
bool valid_world(const proto::RecordingHeader& header) {
  proto::Experiment experiment;
  *experiment.mutable_arena() = header.arena();
  *experiment.mutable_obstacle() = header.obstacle();
  *experiment.mutable_movable() = header.movable();
  try {
    static_cast<void>(World(experiment));
  } catch (const std::invalid_argument&) {
    return false;
  }
  return true;
}

/// Whether the groups contain all robots. Recordings without groups are valid, too.
bool valid_groups(const proto::RecordingHeader& header) {
  const auto& groups = header.group_robots();
  return groups.empty() || std::accumulate(groups.begin(), groups.end(), std::uint64_t{0}) == header.robots();
}

/// Whether the sides of cells are those of the groups.
bool valid_cells(const proto::RecordingHeader& header) {
  const auto& sides = header.group_cell_mm();
  return sides.empty() ||
         (sides.size() == header.group_robots_size() &&
          std::all_of(sides.begin(), sides.end(), [](double side) { return side >= 0 && side <= 1e4; }));
}

/// Whether the fields have the ranges of idl/experiment.proto.
bool valid(const proto::RecordingHeader& header) {
  return in_range(header.tick_cycles(), 1 << 15, 1 << 20) && in_range(header.robots(), 1, kMostRobots) &&
         in_range(header.every_s(), 1e-3, 1e9) && in_range(header.arena_width_mm(), 1, 1e6) &&
         in_range(header.arena_height_mm(), 1, 1e6) && valid_tick(header.first_tick()) && valid_groups(header) &&
         valid_cells(header) && valid_world(header);
}

}  // namespace

Reader::Reader(std::filesystem::path file) : file_(std::move(file)) {
  struct stat about {};
  const auto unreadable = [&](const std::string& reason) {
    return UserError(fmt::format("{}: cannot be read: {}; expected a run directory or its recording.ktrec",
                                 file_.string(), reason));
  };
  const auto foreign = [&](std::string_view why) {
    return UserError(fmt::format("{}: not a Kilotwin recording; {}", file_.string(), why));
  };
  if (::stat(file_.c_str(), &about) != 0) throw unreadable(os::system_reason());
  if (!S_ISREG(about.st_mode)) throw foreign("expected a file, the recording.ktrec of a run directory");
  descriptor_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw unreadable(os::system_reason());
  try {
    if (!read_record() || !record_.has_header()) {
      if (begins_as_format_1()) {
        throw foreign(
            fmt::format("it has format 1 of an older version, this one reads format {}; run the experiment again",
                        kRecordingFormat));
      }
      if (damaged_)
        throw foreign("damaged at byte 0, or another file; expected the recording.ktrec of a run directory");
      throw foreign(about.st_size == 0 ? "it is empty; expected the recording.ktrec of a run directory"
                                       : "expected the recording.ktrec of a run directory");
    }
    header_ = std::move(*record_.mutable_header());
    if (header_.format() != kRecordingFormat) {
      throw foreign(
          fmt::format("it has format {}, this program reads format {}", header_.format(), kRecordingFormat));
    }
    if (!valid(header_)) throw foreign("its header has values that no run has");
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
  records_from_ = offset_;
  rewind();
}

Reader::~Reader() { ::close(descriptor_); }

void Reader::rewind() { go_to(records_from_); }

void Reader::go_to(std::uint64_t offset) {
  offset_ = offset;
  ended_ = damaged_ = false;
  warning_.clear();
  last_state_ = header_.first_tick() - 1;
}

void Reader::warn(std::string_view what) {
  warning_ = fmt::format("{}: {} at byte {}; read up to there", file_.string(), what, offset_);
}

void Reader::warn_of_damage(std::string_view what) {
  damaged_ = true;
  warn(what.empty() ? "damaged" : fmt::format("damaged: {}", what));
}

/// Whether the file begins with a length and the CRC of a record of that length, as format 1 does.
bool Reader::begins_as_format_1() {
  constexpr std::size_t kPrefix_bytes = 8;
  offset_ = 0;
  if (!fill(kPrefix_bytes)) return false;
  const std::uint32_t length = get_u32(waiting()), crc = get_u32(waiting().subspan(4));
  if (length == 0 || length > kLongestRecord_bytes || !fill(kPrefix_bytes + length)) return false;
  return ::crc32_z(0, waiting().data() + kPrefix_bytes, length) == crc;
}

std::span<const std::uint8_t> Reader::waiting() const {
  return std::span(block_).subspan(static_cast<std::size_t>(offset_ - block_from_));
}

/// Whether the file has this number of bytes from offset_ on; if so, waiting() contains them.
bool Reader::fill(std::size_t bytes) {
  const std::uint64_t block_end = block_from_ + block_.size();
  if (offset_ >= block_from_ && offset_ <= block_end && block_end - offset_ >= bytes) return true;
  struct stat about {};
  if (::fstat(descriptor_, &about) != 0) return false;
  const auto size = static_cast<std::uint64_t>(about.st_size);
  if (offset_ > size || size - offset_ < bytes) return false;  // before allocating memory
  block_from_ = offset_;
  block_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size - offset_, std::max(bytes, kBlock_bytes))));
  std::size_t got = 0;
  while (got < block_.size()) {
    const ssize_t n =
        ::pread(descriptor_, block_.data() + got, block_.size() - got, static_cast<off_t>(block_from_ + got));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      block_.clear();
      throw RunError(fmt::format("{}: cannot be read: {}", file_.string(), os::system_reason()));
    }
    if (n == 0) break;
    got += static_cast<std::size_t>(n);
  }
  block_.resize(got);
  return got >= bytes;
}

/// Reads the frame at offset_ into record_ and advances offset_. Returns false at the end; a warning is set if the end is
/// within a frame.
bool Reader::read_record() {
  warning_.clear();
  damaged_ = false;
  if (!fill(kFramePrefix_bytes)) {
    if (fill(1)) warn("cut off");
    return false;
  }
  const std::uint32_t length = get_u32(waiting());
  const std::uint32_t crc = get_u32(waiting().subspan(4));
  // The length has its own checksum: otherwise a changed length would look like a file that was cut off.
  if (::crc32_z(0, waiting().data(), 8) != get_u32(waiting().subspan(8)) || length == 0 ||
      length > kLongestRecord_bytes) {
    warn_of_damage();
    return false;
  }
  if (!fill(kFramePrefix_bytes + length)) {
    warn("cut off");
    return false;
  }
  const std::span<const std::uint8_t> body = waiting().subspan(kFramePrefix_bytes, length);
  const google::protobuf::LogSilencer quiet;  // protobuf would report text that is not UTF-8 on stderr
  if (::crc32_z(0, body.data(), body.size()) != crc ||
      !record_.ParseFromArray(body.data(), static_cast<int>(length))) {
    warn_of_damage();
    return false;
  }
  offset_ += kFramePrefix_bytes + length;
  return true;
}

/// Why a tracker's sample is not valid; nullptr where it is.
const char* Reader::defect_of_sample(const proto::TrackerRecord& sample) const {
  const int n = sample.robot_size();
  const auto octets = static_cast<std::size_t>(n);
  if (!valid_tick(sample.tick())) return "a tracker's sample at a tick out of range";
  if (sample.state().size() != octets || sample.led().size() != octets || sample.x_size() != n ||
      sample.y_size() != n || sample.heading_rad_size() != n || sample.xx_size() != n || sample.xy_size() != n ||
      sample.yy_size() != n || sample.heading_variance_rad2_size() != n) {
    return "a tracker's sample whose columns differ in length";
  }
  const auto known = [&](std::uint32_t robot) { return robot < header_.robots(); };
  if (!std::all_of(sample.robot().begin(), sample.robot().end(), known))
    return "a tracker's sample of unknown robots";
  const auto finite = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
  };
  if (!finite(sample.x()) || !finite(sample.y()) || !finite(sample.heading_rad()) || !finite(sample.xx()) ||
      !finite(sample.xy()) || !finite(sample.yy())) {
    return "a tracker's sample with values out of range";
  }
  constexpr std::size_t kMessageOctets = 10;
  const int messages = sample.heard_robot_size();
  if (sample.heard_listener_size() != messages || sample.heard_distance_mm_size() != messages ||
      sample.heard_message().size() != static_cast<std::size_t>(messages) * kMessageOctets) {
    return "messages of listeners whose columns differ in length";
  }
  constexpr std::uint32_t kUnknown = 0xffffffffu;
  const auto known_or_none = [&](std::uint32_t robot) { return robot == kUnknown || known(robot); };
  if (!std::all_of(sample.heard_robot().begin(), sample.heard_robot().end(), known_or_none) ||
      !std::all_of(sample.heard_listener().begin(), sample.heard_listener().end(), known_or_none) ||
      !finite(sample.heard_distance_mm())) {
    return "messages of listeners with values out of range";
  }
  return nullptr;
}

const char* Reader::defect_of_variable(const proto::VariableRecord& variable) const {
  if (!valid_tick(variable.tick())) return "a variable at a tick out of range";
  if (variable.variable() >= static_cast<std::uint32_t>(header_.variable_size()))
    return "a variable without a name";
  const bool integer = header_.variable(static_cast<int>(variable.variable())).integer();
  const int values = integer ? variable.integer_size() : variable.number_size();
  if (values != variable.robot_size() || variable.integer_size() + variable.number_size() != values)
    return "a variable whose columns differ in length";
  std::int64_t last = -1;
  for (const std::uint32_t robot : variable.robot()) {
    if (robot >= header_.robots() || robot <= last) return "a variable of robots out of order";
    last = robot;
  }
  return nullptr;
}

const char* Reader::defect_of_event(const proto::EventRecord& event) const {
  if (!valid_tick(event.tick())) return "an event at a tick out of range";
  const auto known = [&](std::uint32_t robot) { return robot < header_.robots(); };
  if (!std::all_of(event.robot().begin(), event.robot().end(), known) ||
      !std::all_of(event.sender().begin(), event.sender().end(), known))
    return "an event of unknown robots";
  struct Sizes {
    int robot, value, sender, distance, offset, text;
  };
  const int n = event.kind() == proto::STATION ? event.value_size() : event.robot_size();
  const Sizes found{event.robot_size(),       event.value_size(),         event.sender_size(),
                    event.distance_mm_size(), event.offset_cycles_size(), event.text_size()};
  const auto are = [&](const Sizes& wanted) { return std::memcmp(&found, &wanted, sizeof found) == 0; };
  bool right = false;
  switch (event.kind()) {
    case proto::LED:
    case proto::MOTION:
    case proto::STATE: right = are({n, n, 0, 0, 0, 0}); break;
    case proto::SENT: right = are({n, 0, 0, 0, n, 0}); break;
    case proto::RECEIVED: right = are({n, 0, n, n, n, 0}); break;
    case proto::STATION: right = are({0, n, 0, 0, n, n}); break;
    case proto::FAILURE: right = are({n, 0, 0, 0, 0, n}); break;
  }
  return right ? nullptr : "an event whose columns differ in length";
}

/// Reason why record_ is invalid; nullptr if it is valid.
const char* Reader::defect_of_record() const {
  const auto robots = static_cast<int>(header_.robots());
  switch (record_.kind_case()) {
    case proto::Record::kHeader: return "a second header";
    case proto::Record::kState: {
      const proto::StateRecord& state = record_.state();
      if (state.x_mm_size() != robots || state.y_mm_size() != robots || state.heading_rad_size() != robots ||
          state.led().size() != header_.robots() || state.life_cycle().size() != header_.robots()) {
        return "a state of another number of robots";
      }
      const int movables = header_.movable_size();
      if (state.movable_x_mm_size() != movables || state.movable_y_mm_size() != movables ||
          state.movable_heading_rad_size() != movables) {
        return "a state of another number of movable bodies";
      }
      const int measured = state.measured_x_mm_size();
      if ((measured != 0 && measured != robots) || state.measured_y_mm_size() != measured ||
          state.measured_heading_rad_size() != measured) {
        return "a state with measured poses of another number of robots";
      }
      if (!valid_tick(state.tick()) || state.tick() <= last_state_) return "a state out of order";
      if (!all_within(state.x_mm(), kFarthest_mm) || !all_within(state.y_mm(), kFarthest_mm) ||
          !all_within(state.heading_rad(), 2 * kPi) || !all_within(state.movable_x_mm(), kFarthest_mm) ||
          !all_within(state.movable_y_mm(), kFarthest_mm) || !all_within(state.movable_heading_rad(), 2 * kPi) ||
          !all_within(state.measured_x_mm(), kFarthest_mm) || !all_within(state.measured_y_mm(), kFarthest_mm) ||
          !all_within(state.measured_heading_rad(), 2 * kPi)) {
        return "a state with a pose out of range";
      }
      return nullptr;
    }
    case proto::Record::kHash:
      return valid_tick(record_.hash().first_tick()) ? nullptr : "hashes of ticks out of range";
    case proto::Record::kFloor: {
      constexpr std::uint32_t kMostCells = 256;
      const proto::FloorRecord& floor = record_.floor();
      const auto circles = static_cast<std::size_t>(floor.circle_name_size());
      const bool right = floor.columns() <= kMostCells && floor.rows() <= kMostCells &&
                         floor.rgba().size() == std::size_t{4} * floor.columns() * floor.rows() &&
                         static_cast<std::size_t>(floor.circle_mm_size()) == 3 * circles &&
                         floor.circle_rgba().size() == 4 * circles && all_within(floor.circle_mm(), kFarthest_mm);
      return right && valid_tick(floor.tick()) ? nullptr : "a floor out of range";
    }
    case proto::Record::kInput:
      return valid_tick(record_.input().tick()) ? nullptr : "an input at a tick out of range";
    case proto::Record::kTracker: return defect_of_sample(record_.tracker());
    case proto::Record::kVariable: return defect_of_variable(record_.variable());
    case proto::Record::kEvent: return defect_of_event(record_.event());
    case proto::Record::kMessages: {
      const proto::MessagesRecord& messages = record_.messages();
      const auto known = [&](std::uint32_t robot) { return robot < header_.robots(); };
      const bool right = messages.receiver_size() == messages.sender_size() &&
                         messages.sender_size() == messages.count_size() &&
                         std::all_of(messages.receiver().begin(), messages.receiver().end(), known) &&
                         std::all_of(messages.sender().begin(), messages.sender().end(), known);
      return right ? nullptr : "messages of robots that do not exist";
    }
    case proto::Record::kRadio: {
      const proto::RadioRecord& radio = record_.radio();
      const bool right = radio.attempted_size() == robots && radio.sent_size() == robots &&
                         radio.received_size() == robots && radio.collided_size() == robots &&
                         radio.backed_off_size() == robots;
      return right ? nullptr : "counts of another number of robots";
    }
    case proto::Record::kEnd: return valid_tick(record_.end().tick()) ? nullptr : "an end at a tick out of range";
    case proto::Record::KIND_NOT_SET: return nullptr;
  }
  return nullptr;
}

const proto::Record* Reader::next() {
  while (!ended_) {
    const std::uint64_t start = offset_;
    if (!read_record()) return nullptr;
    if (const char* const defect = defect_of_record()) {
      offset_ = start;
      warn_of_damage(defect);
      return nullptr;
    }
    if (record_.kind_case() == proto::Record::KIND_NOT_SET) continue;  // a kind that this version does not know
    if (record_.has_state()) last_state_ = record_.state().tick();
    if (record_.has_end()) ended_ = true;
    return &record_;
  }
  return nullptr;
}

const proto::StateRecord* Reader::next_state() {
  while (const proto::Record* record = next()) {
    if (record->has_state()) return &record->state();
  }
  return nullptr;
}

}  // namespace kilotwin::recorder
