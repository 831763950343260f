#include "core/os/files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

bool usable(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  return fs::is_directory(directory, error) && access(directory.c_str(), W_OK | X_OK) == 0;
}

/// Makes it if need be; false where it is a link, another user's, or open to others.
bool own_private_directory(const fs::path& directory) {
  struct stat status {};
  if (mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST) return false;
  return lstat(directory.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
         (status.st_mode & 077) == 0 && access(directory.c_str(), W_OK | X_OK) == 0;
}

fs::path from_environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing here changes the environment
  return value != nullptr && value[0] == '/' ? fs::path(value) : fs::path();
}

}  // namespace

std::optional<std::string> read_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream octets;
  octets << file.rdbuf();
  if (!file || !octets) return std::nullopt;
  return std::move(octets).str();
}

bool write_file(const fs::path& path, std::string_view octets) {
  // As readable as the user's other files (mkstemp would keep it from a colleague who replays the run).
  static std::atomic<unsigned> counter{0};
  const std::string temporary = path.string() + '.' + std::to_string(getpid()) + '.' + std::to_string(counter++);
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return false;
  while (!octets.empty()) {
    const ssize_t written = write(descriptor, octets.data(), octets.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    octets.remove_prefix(static_cast<std::size_t>(written));
  }
  const bool whole = octets.empty();
  if (close(descriptor) == 0 && whole && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  unlink(temporary.c_str());
  return false;
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
  // Without a home: a directory that all runs of this user share, where nobody else can write.
  const fs::path shared = fs::temp_directory_path(error) / ("kilotwin-" + std::to_string(geteuid()));
  if (own_private_directory(shared)) return shared;
  std::string temporary = (fs::temp_directory_path(error) / "kilotwin-XXXXXX").string();
  if (mkdtemp(temporary.data()) == nullptr) {
    throw RunError("no directory for compiled programs: " + temporary + ": " + std::strerror(errno) +
                   "; make ~/.cache or /tmp writable, or set XDG_CACHE_HOME");
  }
  return temporary;
}

}  // namespace kilotwin::behaviours
