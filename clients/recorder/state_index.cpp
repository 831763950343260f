#include "clients/recorder/state_index.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>

#include "clients/recorder/recording.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

using google::protobuf::internal::WireFormatLite;

/// The part of a record that is read: its frame's prefix, its kind and length, and its first two fields.
constexpr std::size_t kRead_bytes = kFramePrefix_bytes + 36;
/// Indices of variables and kinds of events beyond this are damage.
constexpr std::size_t kMostLists = 4096;

std::uint32_t get_u32(const std::uint8_t* from) {
  return from[0] | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16 | std::uint32_t{from[3]} << 24;
}

struct Beginning {
  int kind = 0;                               ///< field number in Record
  std::optional<std::int64_t> first, second;  ///< fields 1 and 2, where they are whole numbers
};

Beginning beginning_of(const std::uint8_t* from, std::size_t size) {
  google::protobuf::io::CodedInputStream in(from, static_cast<int>(size));
  Beginning beginning;
  beginning.kind = WireFormatLite::GetTagFieldNumber(in.ReadTag());
  std::uint32_t length = 0;
  if (!in.ReadVarint32(&length)) return beginning;
  const auto take = [&in](int field) -> std::optional<std::int64_t> {
    std::uint64_t value = 0;
    if (in.ReadTag() != WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_VARINT) || !in.ReadVarint64(&value))
      return std::nullopt;
    return static_cast<std::int64_t>(value);
  };
  beginning.first = take(1);
  if (beginning.first) beginning.second = take(2);
  return beginning;
}

/// Keeps ticks in ascending order. Records of several hosts are in order but for the last few.
void insert(std::vector<StateIndex::Entry>& entries, StateIndex::Entry entry) {
  auto at = entries.end();
  while (at != entries.begin() && std::prev(at)->tick > entry.tick) --at;
  entries.insert(at, entry);
}

void insert(std::vector<std::vector<StateIndex::Entry>>& lists, std::int64_t list, StateIndex::Entry entry) {
  if (list < 0 || static_cast<std::size_t>(list) >= kMostLists) return;
  if (lists.size() <= static_cast<std::size_t>(list)) lists.resize(static_cast<std::size_t>(list) + 1);
  insert(lists[static_cast<std::size_t>(list)], entry);
}

const std::vector<StateIndex::Entry>& list_of(const std::vector<std::vector<StateIndex::Entry>>& lists,
                                              std::size_t list) {
  static const std::vector<StateIndex::Entry> none;
  return list < lists.size() ? lists[list] : none;
}

}  // namespace

StateIndex::StateIndex(const std::filesystem::path& file) : file_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (file_.get() < 0) throw UserError(fmt::format("{}: cannot be read: {}", file.string(), os::system_reason()));
}

bool StateIndex::update() {
  struct stat about {};
  if (::fstat(file_.get(), &about) != 0) return false;
  const std::uint64_t before = offset_;
  while (!ended_ && take_record(static_cast<std::uint64_t>(about.st_size))) {}
  return offset_ != before;
}

/// False where no whole, undamaged frame begins at offset_.
bool StateIndex::take_record(std::uint64_t size) {
  std::array<std::uint8_t, kRead_bytes> bytes{};
  const ssize_t got = ::pread(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset_));
  if (got < static_cast<ssize_t>(kFramePrefix_bytes)) return false;
  const std::uint32_t length = get_u32(bytes.data());
  if (::crc32_z(0, bytes.data(), 8) != get_u32(bytes.data() + 8) || length == 0 || length > kLongestRecord_bytes ||
      size - offset_ < kFramePrefix_bytes + length)
    return false;
  const Beginning record =
      beginning_of(bytes.data() + kFramePrefix_bytes,
                   std::min<std::size_t>(length, static_cast<std::size_t>(got) - kFramePrefix_bytes));
  switch (record.kind) {
    case proto::Record::kStateFieldNumber:
      if (record.first && (states_.empty() || *record.first > states_.back().tick))
        states_.push_back({*record.first, offset_});
      break;
    case proto::Record::kFloorFieldNumber:
      if (record.first) floors_.push_back({*record.first, offset_});
      break;
    case proto::Record::kVariableFieldNumber:
      if (record.second) insert(variables_, *record.second, {*record.first, offset_});
      break;
    case proto::Record::kEventFieldNumber:
      if (record.second) insert(events_, *record.second, {*record.first, offset_});
      break;
    case proto::Record::kTrackerFieldNumber:
      if (record.first) insert(trackers_, {*record.first, offset_});
      break;
    case proto::Record::kInputFieldNumber:  // its second field is the tick
      if (record.second) inputs_.push_back({*record.second, offset_});
      break;
    case proto::Record::kRadioFieldNumber: radio_ = offset_; break;
    case proto::Record::kMessagesFieldNumber: messages_ = offset_; break;
    case proto::Record::kEndFieldNumber: ended_ = true; break;
    default: break;
  }
  offset_ += kFramePrefix_bytes + length;
  return true;
}

const std::vector<StateIndex::Entry>& StateIndex::variable(std::size_t index) const {
  return list_of(variables_, index);
}

const std::vector<StateIndex::Entry>& StateIndex::events(std::size_t kind) const { return list_of(events_, kind); }

std::size_t StateIndex::at_or_before(std::int64_t tick) const {
  const auto after = std::upper_bound(states_.begin(), states_.end(), tick,
                                      [](std::int64_t wanted, const Entry& entry) { return wanted < entry.tick; });
  return after == states_.begin() ? 0 : static_cast<std::size_t>(after - states_.begin()) - 1;
}

}  // namespace kilotwin::recorder
