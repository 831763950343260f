/// Reader of compiled robots' programs: self-contained ELF64 shared objects for x86-64.
///
/// The reader is the project's own, because it is the loader: the program runs in this process, so every offset that is used
/// later must be checked for this runtime's layout. libelf checks the format only. Line tables serve error messages alone;
/// libdw reads them (line_table.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/behaviours/line_table.hpp"
#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {

/// parse() checks everything. Offsets are octets from the start of the image and lie inside it.
class ElfFile {
 public:
  /// `name`: the file's name for error lines. Throws UserError if `octets` are not a program of this runtime's version.
  [[nodiscard]] static ElfFile parse(std::string_view octets, const std::string& name);

  struct Range {
    std::uint64_t first = 0, last = 0;  ///< [first, last)
    [[nodiscard]] bool contains(std::uint64_t at, std::uint64_t size) const {
      return at >= first && at <= last && size <= last - at;
    }
  };
  struct Segment {
    Range range;
    bool writable = false, executable = false;
  };
  struct Function {
    std::uint64_t offset = 0, size = 0;
    std::string name;
  };

  std::vector<std::uint8_t> memory;  ///< the image as loaded at address 0; whole pages
  std::vector<std::uint32_t>
      relocations;                  ///< ascending offsets of 64-bit words to which the image's address is added
  std::vector<Segment> segments;    ///< ascending, no page shared
  Range relro;                      ///< whole pages: read-only once relocated
  Range data;                       ///< a robot's globals and statics, which stay writable
  Range pad;                        ///< writable, unused octets directly before `data`
  Range heap;                       ///< directly behind `data`; empty if the program uses no heap
  std::vector<Range> kept;          ///< parts of `data` that survive a reset: .noinit and EEMEM variables
  KtImage table{};                  ///< its addresses are offsets
  std::vector<Function> functions;  ///< for messages about faults; ascending offsets

  LineTables lines;

  /// Octets from the end of the writable memory, slack included, to the end of its page.
  [[nodiscard]] std::uint64_t unused_octets() const;
  /// The name of the function that contains this offset, or "".
  [[nodiscard]] std::string function_at(std::uint64_t offset) const;
};

/// Slack: writable octets behind a robot's variables and heap. It tolerates short writes past the end of an array, which go
/// unnoticed on the robot too. The host clears it before a robot runs. The compiler aligns its end with the end of a page.
inline constexpr std::uint64_t kSlackOctets = 256;
/// The last octets of the pad before the variables. The host checks after each run of a robot that they are still zero.
inline constexpr std::uint64_t kWatchedOctets = 64;
inline constexpr std::uint64_t kPage = 4096;
[[nodiscard]] constexpr std::uint64_t page_down(std::uint64_t at) { return at & ~(kPage - 1); }
[[nodiscard]] constexpr std::uint64_t page_up(std::uint64_t at) { return page_down(at + kPage - 1); }

}  // namespace kilotwin::behaviours
