#include "core/csv/csv_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin {
namespace {

constexpr std::size_t kWriteAbove_bytes = std::size_t{1} << 20;

/// Writes all octets. Returns errno, 0 on success.
int write_all(int descriptor, const char* at, std::size_t length) {
  while (length > 0) {
    const ssize_t written = ::write(descriptor, at, length);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    at += written;
    length -= static_cast<std::size_t>(written);
  }
  return 0;
}

}  // namespace

struct CsvWriter::Gzip {
  z_stream stream{};
  std::string packed = std::string(std::size_t{1} << 16, '\0');

  Gzip() {
    // 16 selects a gzip header. zlib leaves name and time out of it, so equal tables give equal files.
    constexpr int kGzip = 16 + MAX_WBITS, kMemory = 8;
    if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
      throw RunError("zlib has no memory");
  }
  ~Gzip() { deflateEnd(&stream); }
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;

  /// Returns errno, 0 on success.
  int write(int descriptor, std::string& text, bool last) {
    stream.next_in = reinterpret_cast<Bytef*>(text.data());
    stream.avail_in = static_cast<uInt>(text.size());
    int status = Z_OK;
    do {
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = static_cast<uInt>(packed.size());
      status = deflate(&stream, last ? Z_FINISH : Z_NO_FLUSH);
      if (const int error = write_all(descriptor, packed.data(), packed.size() - stream.avail_out)) return error;
    } while (stream.avail_out == 0 && status != Z_STREAM_END);
    return 0;
  }
};

std::string csv_cell(std::string_view text) {
  const bool blank_end =
      !text.empty() && (text.front() == ' ' || text.front() == '\t' || text.back() == ' ' || text.back() == '\t');
  if (!blank_end && text.find_first_of(",\"\r\n\t") == std::string_view::npos) return std::string(text);
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += '"';
    cell += c;
  }
  return cell + '"';
}

CsvWriter::CsvWriter(std::filesystem::path file, std::string_view header) : file_(std::move(file)) {
  if (file_ == "-") {
    descriptor_ = ::dup(STDOUT_FILENO);
  } else {
    do {
      descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EINTR);
  }
  if (descriptor_ < 0) fail("created", errno);
  if (file_.extension() == ".gz") gzip_ = std::make_unique<Gzip>();
  rows_ = header;
  rows_ += '\n';
}

CsvWriter::~CsvWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void CsvWriter::fail(const char* what, int error) const {
  throw RunError(fmt::format("{}: cannot be {}: {}", file_ == "-" ? "standard output" : file_.string(), what,
                             std::generic_category().message(error)));
}

void CsvWriter::flush() {
  const int error =
      gzip_ ? gzip_->write(descriptor_, rows_, false) : write_all(descriptor_, rows_.data(), rows_.size());
  if (error != 0) fail("written", error);
  rows_.clear();
}

void CsvWriter::flush_if_long() {
  if (rows_.size() >= kWriteAbove_bytes) flush();
}

void CsvWriter::close() {
  if (descriptor_ < 0) return;
  if (gzip_) {
    if (const int error = gzip_->write(descriptor_, rows_, true)) fail("written", error);
    rows_.clear();
  } else {
    flush();
  }
  // Network file systems may report a full disk only here.
  if (::close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR) fail("written", errno);
}

}  // namespace kilotwin
