#include "clients/recorder/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::recorder {

std::string system_reason() { return std::generic_category().message(errno); }

OutputFile::OutputFile(std::filesystem::path file, Existing existing) : file_(std::move(file)) {
  const int how = existing == Existing::kRefuse ? O_EXCL : O_TRUNC;
  do {
    descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0666);
  } while (descriptor_ < 0 && errno == EINTR);
  if (descriptor_ < 0) throw RunError(fmt::format("{}: cannot be created: {}", file_.string(), system_reason()));
}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  try {
    flush();
  } catch (const RunError&) {
    // Destructors report no errors.
  }
  ::close(descriptor_);
}

void OutputFile::flush() {
  std::size_t written = 0;
  while (written < buffer_.size()) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + written, buffer_.size() - written);
    if (n >= 0) {
      written += static_cast<std::size_t>(n);
    } else if (errno != EINTR) {
      const std::string reason = system_reason();
      buffer_.erase(0, written);
      throw RunError(fmt::format("{}: cannot be written: {}", file_.string(), reason));
    }
  }
  buffer_.clear();
}

void OutputFile::close() {
  if (descriptor_ < 0) return;
  flush();
  // Network file systems report a full disk here at the latest.
  if (::close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR) {
    throw RunError(fmt::format("{}: cannot be written: {}", file_.string(), system_reason()));
  }
}

void write_file(const std::filesystem::path& file, std::string_view content) {
  // Only a regular file can be replaced; a device or a pipe is written to.
  std::error_code none;
  if (std::filesystem::exists(file, none) && !std::filesystem::is_regular_file(file, none)) {
    OutputFile output(file, OutputFile::Existing::kReplace);
    output.buffer() = content;
    output.close();
    return;
  }
  std::filesystem::path draft = file;
  draft += fmt::format(".{}.part", ::getpid());
  try {
    OutputFile output(draft, OutputFile::Existing::kReplace);
    output.buffer() = content;
    output.close();
    if (::rename(draft.c_str(), file.c_str()) != 0) {
      throw RunError(fmt::format("{}: cannot be written: {}", file.string(), system_reason()));
    }
  } catch (const RunError&) {
    ::unlink(draft.c_str());
    throw;
  }
}

std::string read_file(const std::filesystem::path& file) {
  const auto refuse = [&] {
    return UserError(fmt::format("{}: cannot be read: {}", file.string(), system_reason()));
  };
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw refuse();
  std::string content;
  char block[1 << 16];
  for (;;) {
    const ssize_t n = ::read(descriptor, block, sizeof block);
    if (n > 0) {
      content.append(block, static_cast<std::size_t>(n));
    } else if (n == 0) {
      break;
    } else if (errno != EINTR) {
      const UserError error = refuse();
      ::close(descriptor);
      throw error;
    }
  }
  ::close(descriptor);
  return content;
}

}  // namespace kilotwin::recorder
