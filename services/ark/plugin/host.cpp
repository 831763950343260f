/// A process of its own for one plugin: `host PLUGIN.so`, with a socket to the station as standard output. The plugin
/// prints to standard error. A fault, or the station's SIGUSR1 after a call without end, is reported in a last reply that
/// names the function; then the process ends.
#include <dlfcn.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "runner.hpp"

namespace kilotwin {

[[noreturn]] void demand_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: %s does not hold\n", file, line, condition);
  std::abort();
}

}  // namespace kilotwin

namespace {

using namespace kilotwin::station;  // NOLINT(google-build-using-namespace)

int station_socket = -1;
const volatile RunningCall* running = nullptr;
bool is_answering = false;

bool send_all(const char* octets, std::size_t count) {
  while (count > 0) {
    const ssize_t sent = ::send(station_socket, octets, count, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    octets += sent;
    count -= static_cast<std::size_t>(sent);
  }
  return true;
}

bool receive_all(char* octets, std::size_t count) {
  while (count > 0) {
    const ssize_t received = ::recv(station_socket, octets, count, 0);
    if (received <= 0) return false;
    octets += received;
    count -= static_cast<std::size_t>(received);
  }
  return true;
}

bool send_frame(const std::string& octets) {
  const auto size = static_cast<std::uint32_t>(octets.size());
  return send_all(reinterpret_cast<const char*>(&size), sizeof size) && send_all(octets.data(), octets.size());
}

bool reply(Reply reply) {
  Archive archive;
  reply.serialize(archive);
  return send_frame(archive.octets());
}

/// A last word without memory from the heap, which may be damaged: the length ~0, the signal, the robot, the function's name.
void last_word(int signal) {
  struct {
    std::uint32_t mark = ~0u;
    std::int32_t signal = 0, robot = -1;
    std::array<char, 52> function{};
  } word;
  word.signal = signal;
  if (running != nullptr && running->function != nullptr) {
    word.robot = running->robot;
    const char* const name = running->function;
    for (std::size_t i = 0; i + 1 < word.function.size() && name[i] != 0; ++i) word.function[i] = name[i];
  }
  send_all(reinterpret_cast<const char*>(&word), sizeof word);
  _exit(1);
}

void catch_signals() {
  static std::array<char, 65536> stack;
  stack_t own{};
  own.ss_sp = stack.data();
  own.ss_size = stack.size();
  sigaltstack(&own, nullptr);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS, SIGABRT, SIGUSR1}) {
    struct sigaction action {};
    action.sa_handler = last_word;
    action.sa_flags = SA_ONSTACK;
    sigfillset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
  }
  // Those of a terminal are for the run, which ends this process when it ends itself.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
}

/// A plugin that calls exit() ends here, not in the midst of the station's wait.
void at_exit() {
  if (is_answering) last_word(0);
}

int serve(const char* file) {
  void* const library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  Reply failed;
  if (library == nullptr) {
    const char* const why = dlerror();  // NOLINT(concurrency-mt-unsafe): one thread
    failed.failure = std::string("it cannot be loaded: ") + (why == nullptr ? "" : why);
  }
  auto* const create =
      library == nullptr ? nullptr : reinterpret_cast<KilobotExperiment* (*)()>(dlsym(library, "createExpt"));
  if (library != nullptr && create == nullptr) failed.failure = "it has no createExpt()";
  std::unique_ptr<Runner> runner;
  is_answering = true;
  try {
    if (create != nullptr) runner = std::make_unique<Runner>(std::unique_ptr<KilobotExperiment>(create()));
  } catch (const std::exception& error) {
    failed.failure = std::string("createExpt: ") + error.what();
  }
  is_answering = false;
  if (runner != nullptr) running = &runner->running();
  for (std::uint32_t size = 0; receive_all(reinterpret_cast<char*>(&size), sizeof size);) {
    std::string octets(size, '\0');
    if (!receive_all(octets.data(), octets.size())) break;
    Archive archive(std::move(octets));
    Request request;
    request.serialize(archive);
    is_answering = true;
    Reply answer = runner == nullptr ? failed : runner->answer(request);
    is_answering = false;
    if (!reply(std::move(answer))) break;
    if (request.call == Call::kStop) break;
  }
  // Destructors of a plugin that has failed might do anything.
  std::fflush(nullptr);
  _exit(0);
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return 2;
  station_socket = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  catch_signals();
  std::atexit(at_exit);
  rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  return serve(words[1]);
}
