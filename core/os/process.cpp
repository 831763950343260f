#include "core/os/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"
#include "core/os/files.hpp"

namespace kilotwin::os {
namespace {

struct Pipe {
  Descriptor read_end, write_end;
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw RunError("cannot start a program: " + system_reason());
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

std::string signal_name(int signal) {
  const char* const words = sigdescr_np(signal);
  return fmt::format("signal {}{}", signal, words == nullptr ? "" : fmt::format(" ({})", words));
}

Process::Process(const Command& command) : own_group_(command.own_group) {
  KILOTWIN_DEMAND(!command.arguments.empty());
  const std::string program = command.program.empty() ? command.arguments[0] : command.program.string();
  std::vector<std::string> argument_texts = command.arguments, environment_texts;
  std::vector<char*> own_environment;
  const std::vector<char*> arguments = pointers(argument_texts);
  if (command.environment == Command::Environment::kPlain) {
    environment_texts = plain_environment();
    own_environment = pointers(environment_texts);
  }
  char** const environment = own_environment.empty() ? environ : own_environment.data();
  const Descriptor nothing(open("/dev/null", O_RDWR | O_CLOEXEC));
  Pipe trouble;  // exec closes it; if exec fails, the child writes errno to it
  const pid_t parent = getpid();
  id_ = fork();
  if (id_ < 0) throw RunError(fmt::format("cannot start {}: {}", program, system_reason()));
  if (id_ == 0) {
    // Between fork and exec only async-signal-safe calls are allowed.
    if (command.own_group) setpgid(0, 0);
    if (command.at_death != 0) prctl(PR_SET_PDEATHSIG, command.at_death);
    if (command.at_death != 0 && getppid() != parent) _exit(127);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    const auto connect = [&](int from, int to) {
      if (from == Command::kInherit) return;
      dup2(from == Command::kDiscard ? nothing.get() : from, to);
    };
    // Both descriptors are duplicated first, because output may be 2 and errors may be 1.
    const int errors = command.errors == STDOUT_FILENO && command.output != Command::kInherit ? dup(STDOUT_FILENO)
                                                                                              : command.errors;
    connect(command.input, STDIN_FILENO);
    connect(command.output, STDOUT_FILENO);
    connect(errors, STDERR_FILENO);
    execve(program.c_str(), arguments.data(), environment);
    const int error = errno;
    const ssize_t written = write(trouble.write_end.get(), &error, sizeof error);
    _exit(written == sizeof error ? 127 : 126);
  }
  trouble.write_end.reset();
  int error = 0;
  ssize_t octets = 0;
  do octets = read(trouble.read_end.get(), &error, sizeof error);
  while (octets < 0 && errno == EINTR);
  if (octets != sizeof error) return;
  wait();
  throw RunError(fmt::format("cannot start {}: {}", program, std::generic_category().message(error)));
}

Process::Process(Process&& other) noexcept
    : id_(std::exchange(other.id_, -1)), own_group_(other.own_group_), end_(other.end_) {}

Process::~Process() {
  if (id_ < 0 || end_) return;
  signal(SIGKILL);
  collect(0);
}

bool Process::collect(int flags) {
  int status = 0;
  pid_t found = 0;
  do found = waitpid(id_, &status, flags);
  while (found < 0 && errno == EINTR);
  if (found != id_) return false;
  if (WIFSIGNALED(status))
    end_ = ProcessEnd{0, WTERMSIG(status)};
  else
    end_ = ProcessEnd{WEXITSTATUS(status), 0};
  return true;
}

const std::optional<ProcessEnd>& Process::poll() {
  if (!end_) collect(WNOHANG);
  return end_;
}

ProcessEnd Process::wait() {
  if (!end_ && !collect(0)) throw RunError(fmt::format("cannot wait for process {}: {}", id_, system_reason()));
  return *end_;
}

void Process::signal(int number) const {
  if (id_ > 0 && !end_) kill(own_group_ ? -id_ : id_, number);
}

ProcessResult run_process(const std::vector<std::string>& arguments) {
  Pipe output, errors;
  Command command;
  command.arguments = arguments;
  command.output = output.write_end.get();
  command.errors = errors.write_end.get();
  command.environment = Command::Environment::kPlain;
  Process process(command);
  output.write_end.reset();
  errors.write_end.reset();
  ProcessResult result;
  drain(output, errors, result);
  result.end = process.wait();
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

}  // namespace kilotwin::os
