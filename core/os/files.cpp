#include "core/os/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"

namespace kilotwin::os {
namespace fs = std::filesystem;
namespace {

bool usable(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  return fs::is_directory(directory, error) && access(directory.c_str(), W_OK | X_OK) == 0;
}

/// Creates the directory if it does not exist. False if the path is a link, belongs to another user, or is open to others.
bool own_private_directory(const fs::path& directory) {
  struct stat status {};
  if (mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST) return false;
  return lstat(directory.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
         (status.st_mode & 077) == 0 && access(directory.c_str(), W_OK | X_OK) == 0;
}

/// Reads the descriptor to its end and appends to `content`. On failure returns false and leaves errno set.
bool read_all(int descriptor, std::string& content) {
  struct stat status {};
  if (fstat(descriptor, &status) == 0 && status.st_size > 0)
    content.reserve(static_cast<std::size_t>(status.st_size) + 1);
  char block[1 << 16];
  for (;;) {
    const ssize_t n = read(descriptor, block, sizeof block);
    if (n > 0)
      content.append(block, static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      return n == 0;
  }
}

fs::path from_environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing here changes the environment
  return value != nullptr && value[0] == '/' ? fs::path(value) : fs::path();
}

}  // namespace

std::string system_reason() { return std::generic_category().message(errno); }

std::string read_file(const fs::path& file) {
  const Descriptor descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC));
  std::string content;
  if (descriptor.get() < 0 || !read_all(descriptor.get(), content))
    throw UserError(fmt::format("{}: cannot be read: {}", file.string(), system_reason()));
  return content;
}

std::optional<std::string> read_if_there(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  const Descriptor descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC));
  std::string content;
  if (descriptor.get() < 0 || !read_all(descriptor.get(), content)) return std::nullopt;
  return content;
}

void write_file(const fs::path& file, std::string_view content) {
  const auto write_to = [&](const fs::path& path) {
    OutputFile output(path, OutputFile::Existing::kReplace);
    output.buffer() = content;
    output.close();
  };
  std::error_code none;
  if (fs::exists(file, none) && !fs::is_regular_file(file, none)) return write_to(file);
  // open() with the user's umask. mkstemp() would make the file unreadable for a colleague who replays the run.
  static std::atomic<unsigned> counter{0};
  fs::path draft = file;
  draft += fmt::format(".{}.{}.part", getpid(), counter++);
  try {
    write_to(draft);
    if (std::rename(draft.c_str(), file.c_str()) != 0)
      throw RunError(fmt::format("{}: cannot be written: {}", file.string(), system_reason()));
  } catch (const RunError&) {
    unlink(draft.c_str());
    throw;
  }
}

OutputFile::OutputFile(fs::path file, Existing existing) : file_(std::move(file)) {
  const int how = existing == Existing::kRefuse ? O_EXCL : existing == Existing::kReplace ? O_TRUNC : O_APPEND;
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
    // A destructor cannot throw.
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
  // Network file systems may report a full disk only here.
  if (::close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR) {
    throw RunError(fmt::format("{}: cannot be written: {}", file_.string(), system_reason()));
  }
}

fs::path cache_directory(const fs::path& wanted) {
  if (!wanted.empty() && usable(wanted)) return wanted;
  if (const fs::path base = from_environment("XDG_CACHE_HOME"); !base.empty() && usable(base / "kilotwin")) {
    return base / "kilotwin";
  }
  if (const fs::path home = from_environment("HOME"); !home.empty() && usable(home / ".cache/kilotwin")) {
    return home / ".cache/kilotwin";
  }
  std::error_code error;
  // Without a home directory: one that all runs of this user share and nobody else can write to.
  const fs::path shared = fs::temp_directory_path(error) / ("kilotwin-" + std::to_string(geteuid()));
  if (own_private_directory(shared)) return shared;
  std::string temporary = (fs::temp_directory_path(error) / "kilotwin-XXXXXX").string();
  if (mkdtemp(temporary.data()) == nullptr) {
    throw RunError("no directory for compiled programs: " + temporary + ": " + system_reason() +
                   "; make ~/.cache or /tmp writable, or set XDG_CACHE_HOME");
  }
  return temporary;
}

}  // namespace kilotwin::os
