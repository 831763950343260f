/// Structs and numbers of Arrow's file format, for its reader and its writer:
/// https://arrow.apache.org/docs/format/Columnar.html. The headers of a file are flatbuffers. The numbers are those of Arrow's
/// Schema.fbs, Message.fbs and File.fbs.
#pragma once

#include <cstdint>
#include <string_view>

namespace kilotwin::arrow {

inline constexpr std::string_view kMagic = "ARROW1";  ///< begins and ends a file
enum class Header : std::uint8_t { kSchema = 1, kRecordBatch = 3 };
enum class Type : std::uint8_t {
  kNull = 1,
  kInt = 2,
  kFloatingPoint = 3,
  kBinary = 4,
  kUtf8 = 5,
  kLargeBinary = 19,
  kLargeUtf8 = 20
};
inline constexpr std::int16_t kSingle = 1, kDouble = 2;  ///< precision of a floating-point number

/// Structs that stand in vectors without a table around: a column's rows and missing values, octets of a body, a message.
struct FieldNode {
  std::int64_t length, missing;
};
struct Buffer {
  std::int64_t offset, length;
};
struct Block {
  std::int64_t offset;
  std::int32_t head, padding;
  std::int64_t body;
};

/// Place of a flatbuffers table's field in its list of places, by the field's number.
constexpr std::uint16_t place_of(int field) { return static_cast<std::uint16_t>(4 + 2 * field); }

}  // namespace kilotwin::arrow
