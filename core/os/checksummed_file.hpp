/// Files in which checksums cover every octet: manifests and the parts of checkpoints.
///
/// Layout, integers little-endian:
///   magic    8 octets, per kind of file
///   format   u32, per kind of file
///   block    u32, kBlock_bytes
///   length   u64, octets of content
///   crc      u32, CRC-32 (IEEE 802.3) of the 24 octets above
///   blocks   each min(kBlock_bytes, remaining octets) of content, then u32, the CRC-32 of the block's number (u64) and content
///
/// With blocks of 8 KiB, CRC-32 detects every change of up to three bits within a block. It detects every burst of up to 32 bits
/// (Koopman 2002, "32-Bit Cyclic Redundancy Codes for Internet Applications"). Any other change of a block goes unnoticed
/// with probability 2^-32.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace kilotwin {

struct FileKind {
  std::string_view magic;  ///< 8 octets
  std::uint32_t format;
  std::string_view name;    ///< for error lines, e.g. "the manifest of a run"
  std::string_view remedy;  ///< for error lines, e.g. "prepare the run again"
};

/// Writes the file atomically: to a temporary name in the same directory, then by rename. Throws RunError.
void write_checksummed(const std::filesystem::path& file, const FileKind& kind, std::string_view content);

/// The content. Throws UserError "FILE: what is wrong; the remedy" if the file cannot be read, is of another kind or format, or
/// is damaged. A damage error gives the octet at which the damaged block begins.
[[nodiscard]] std::string read_checksummed(const std::filesystem::path& file, const FileKind& kind);

}  // namespace kilotwin
