#include "core/os/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { reset(-1); }
  [[nodiscard]] int get() const { return fd_; }
  void reset(int fd) {
    if (fd_ >= 0) close(fd_);
    fd_ = fd;
  }

 private:
  int fd_ = -1;
};

struct Pipe {
  Descriptor read_end, write_end;
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw RunError(std::string("pipe: ") + std::strerror(errno));
    read_end.reset(ends[0]);
    write_end.reset(ends[1]);
  }
};

std::vector<std::string> plain_environment() {
  std::vector<std::string> result{"LC_ALL=C", "SOURCE_DATE_EPOCH=0"};
  constexpr std::array<std::string_view, 12> kDropped{"LC_",
                                                      "LANG",
                                                      "CPATH=",
                                                      "C_INCLUDE_PATH=",
                                                      "LIBRARY_PATH=",
                                                      "COMPILER_PATH=",
                                                      "GCC_",
                                                      "DEPENDENCIES_OUTPUT=",
                                                      "SUNPRO_DEPENDENCIES=",
                                                      "SOURCE_DATE_EPOCH=",
                                                      "LD_RUN_PATH=",
                                                      "COLLECT_"};
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    bool dropped = false;
    for (const std::string_view prefix : kDropped) dropped = dropped || text.starts_with(prefix);
    if (!dropped) result.emplace_back(text);
  }
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

/// Reads both ends until both are closed.
void drain(const Pipe& output, const Pipe& errors, ProcessResult& result) {
  std::array<pollfd, 2> ends{pollfd{output.read_end.get(), POLLIN, 0}, pollfd{errors.read_end.get(), POLLIN, 0}};
  const std::array<std::string*, 2> texts{&result.output, &result.errors};
  std::array<char, 65536> buffer;
  while (ends[0].fd >= 0 || ends[1].fd >= 0) {
    if (poll(ends.data(), ends.size(), -1) < 0 && errno != EINTR) return;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i].fd < 0 || ends[i].revents == 0) continue;
      const ssize_t count = read(ends[i].fd, buffer.data(), buffer.size());
      if (count > 0)
        texts[i]->append(buffer.data(), static_cast<std::size_t>(count));
      else if (count == 0 || errno != EINTR)
        ends[i].fd = -1;
    }
  }
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& arguments) {
  KILOTWIN_DEMAND(!arguments.empty());
  Pipe output, errors;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output.write_end.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.write_end.get(), STDERR_FILENO);
  std::vector<std::string> argument_texts = arguments, environment_texts = plain_environment();
  pid_t child = 0;
  const int error = posix_spawn(&child, arguments[0].c_str(), &actions, nullptr, pointers(argument_texts).data(),
                                pointers(environment_texts).data());
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw RunError("cannot start " + arguments[0] + ": " + std::strerror(error));
  output.write_end.reset(-1);
  errors.write_end.reset(-1);
  ProcessResult result;
  drain(output, errors, result);
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw RunError("cannot wait for " + arguments[0] + ": " + std::strerror(errno));
  }
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

std::filesystem::path find_executable(std::string_view name) {
  const char* path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): nothing here changes the environment
  std::string_view rest = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
  while (!rest.empty()) {
    const std::size_t length = std::min(rest.find(':'), rest.size());
    if (const std::string_view directory = rest.substr(0, length); directory.starts_with('/')) {
      std::filesystem::path candidate = std::filesystem::path(directory) / name;
      std::error_code error;
      if (std::filesystem::is_regular_file(candidate, error) && access(candidate.c_str(), X_OK) == 0)
        return candidate;
    }
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
  return {};
}

}  // namespace kilotwin::behaviours
