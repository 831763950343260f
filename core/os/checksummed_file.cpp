#include "core/os/checksummed_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/crc32.hpp"

namespace kilotwin {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock_bytes = 8192;
constexpr std::size_t kMagic_bytes = 8, kHeader_bytes = 28, kCrc_bytes = 4;

void put(std::string& to, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) to += static_cast<char>(value >> 8 * i & 0xff);
}

std::uint64_t get(std::string_view from, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i)
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(from[at + i])) << 8 * i;
  return value;
}

/// The CRC covers the block's number too, so that exchanged blocks are detected.
std::uint32_t crc_of_block(std::uint64_t number, std::string_view content) {
  std::string prefix;
  put(prefix, number, 8);
  return os::crc32(content, os::crc32(prefix));
}

std::uint64_t blocks_of(std::uint64_t length) {
  return length / kBlock_bytes + (length % kBlock_bytes == 0 ? 0 : 1);
}

}  // namespace

void write_checksummed(const fs::path& file, const FileKind& kind, std::string_view content) {
  KILOTWIN_DEMAND(kind.magic.size() == kMagic_bytes);
  std::string bytes(kind.magic);
  bytes.reserve(kHeader_bytes + content.size() + blocks_of(content.size()) * kCrc_bytes);
  put(bytes, kind.format, 4);
  put(bytes, kBlock_bytes, 4);
  put(bytes, content.size(), 8);
  put(bytes, os::crc32(bytes), 4);
  for (std::uint64_t number = 0; !content.empty(); ++number) {
    const std::string_view block = content.substr(0, kBlock_bytes);
    bytes += block;
    put(bytes, crc_of_block(number, block), kCrc_bytes);
    content.remove_prefix(block.size());
  }
  fs::path draft = file;
  draft += fmt::format(".{}", ::getpid());
  std::error_code error;
  {
    errno = 0;
    std::ofstream stream(draft, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!stream.flush()) error = {errno, std::generic_category()};
  }
  if (!error) fs::rename(draft, file, error);
  if (!error) return;
  std::error_code ignored;
  fs::remove(draft, ignored);
  throw RunError(fmt::format("{}: cannot be written: {}", file.string(), error.message()));
}

std::string read_checksummed(const fs::path& file, const FileKind& kind) {
  const auto refuse = [&](std::string_view what) {
    return UserError(fmt::format("{}: {}; {}", file.string(), what, kind.remedy));
  };
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw refuse(fmt::format("cannot be read: {}", std::generic_category().message(errno)));
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (bytes.empty()) throw refuse("is empty");
  if (!bytes.starts_with(kind.magic)) {
    throw refuse(fmt::format("is not {} in format {}: another file, an older format, or damaged at octet 0",
                             kind.name, kind.format));
  }
  const std::string_view all = bytes;
  if (all.size() < kHeader_bytes) throw refuse(fmt::format("is cut off at octet {}", all.size()));
  if (get(all, kHeader_bytes - kCrc_bytes, 4) != os::crc32(all.substr(0, kHeader_bytes - kCrc_bytes)))
    throw refuse("is damaged at octet 0");
  if (const std::uint64_t format = get(all, kMagic_bytes, 4); format != kind.format)
    throw refuse(fmt::format("is of format {}; this program reads format {}", format, kind.format));
  if (const std::uint64_t block = get(all, kMagic_bytes + 4, 4); block != kBlock_bytes)
    throw refuse(fmt::format("has blocks of {} octets; this program reads {}", block, kBlock_bytes));

  const std::uint64_t length = get(all, kMagic_bytes + 8, 8);
  // Allocate nothing by a length from the file before it agrees with the file's size.
  const std::uint64_t rest = all.size() - kHeader_bytes;
  if (length > rest || length + blocks_of(length) * kCrc_bytes > rest)
    throw refuse(fmt::format("is cut off at octet {}", all.size()));
  if (length + blocks_of(length) * kCrc_bytes < rest) {
    throw refuse(
        fmt::format("goes on after its end at octet {}", kHeader_bytes + length + blocks_of(length) * kCrc_bytes));
  }
  std::string content;
  content.reserve(length);
  std::size_t at = kHeader_bytes;
  for (std::uint64_t number = 0; content.size() < length; ++number) {
    const std::string_view block = all.substr(at, std::min<std::uint64_t>(kBlock_bytes, length - content.size()));
    if (get(all, at + block.size(), kCrc_bytes) != crc_of_block(number, block))
      throw refuse(fmt::format("is damaged in the {} octets from octet {} on", block.size() + kCrc_bytes, at));
    content += block;
    at += block.size() + kCrc_bytes;
  }
  return content;
}

}  // namespace kilotwin
