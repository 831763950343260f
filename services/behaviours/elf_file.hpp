/// A compiled robot's program as read from disk: an ELF64 shared object for x86-64 that needs nothing else.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/behaviours/line_table.hpp"
#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {

/// Everything is checked on construction; offsets are octets from the start of the image and lie inside it.
class ElfFile {
 public:
  /// `name` is the file as errors name it. Throws UserError where the octets are no program of this runtime's version.
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

  std::vector<std::uint8_t> memory;  ///< the image as if it lay at address 0; whole pages
  std::vector<std::uint32_t>
      relocations;                  ///< ascending offsets of 64-bit words to which the image's address is added
  std::vector<Segment> segments;    ///< ascending, no page shared
  Range relro;                      ///< whole pages: read-only once relocated
  Range data;                       ///< what stays writable: a robot's globals and statics
  Range pad;                        ///< directly before them, as writable but of no use
  Range heap;                       ///< behind them; empty where a program uses none
  std::vector<Range> kept;          ///< parts of data that outlive a reset: .noinit and EEMEM variables
  KtImage table{};                  ///< with offsets for addresses
  std::vector<Function> functions;  ///< for the text of faults; ascending

  LineTables lines;

  /// Octets from the end of all that is writable, slack included, to the end of its page.
  [[nodiscard]] std::uint64_t unused_octets() const;
  /// The function that holds this offset, or "".
  [[nodiscard]] std::string function_at(std::uint64_t offset) const;
};

/// Memory beyond a robot's variables and heap, for programs that write past the end of an array, as many do unnoticed on the
/// robot. It is zero whenever a robot begins to run. The compiler places variables such that a page ends with it.
inline constexpr std::uint64_t kSlackOctets = 256;
/// Of the pad before the variables, the octets nearest to them are looked at whenever a robot has run.
inline constexpr std::uint64_t kWatchedOctets = 64;
inline constexpr std::uint64_t kPage = 4096;
[[nodiscard]] constexpr std::uint64_t page_down(std::uint64_t at) { return at & ~(kPage - 1); }
[[nodiscard]] constexpr std::uint64_t page_up(std::uint64_t at) { return page_down(at + kPage - 1); }

}  // namespace kilotwin::behaviours
