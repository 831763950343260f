// A plugin in a process of its own: services/ark/plugin/host.cpp at the other end of a socket.
#include <poll.h>
#include <sys/socket.h>
#include <time.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/ark/plugin_host.hpp"

namespace kilotwin::ark {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPoll_ms = 50;
/// For how long a plugin that is asked where it is may take to say so.
constexpr double kLastWord_s = 1;
/// Of a reply: a floor of 256 x 256 cells and as many messages as robots take far less.
constexpr std::uint32_t kLongestReply = 64u << 20;

/// As host.cpp writes it, after the mark.
struct LastWord {
  std::int32_t signal, robot;
  std::array<char, 52> function;
};
constexpr std::uint32_t kLastWordMark = ~0u;

enum class Wait : std::uint8_t { kReady, kEnded, kTooLong };

class PluginProcess final : public PluginHost {
 public:
  PluginProcess(const std::filesystem::path& program, const std::filesystem::path& object, PluginPatience patience)
      : patience_(std::move(patience)), process_(command_of(program, object)) {
    theirs_.reset();
  }

  [[nodiscard]] station::Reply ask(const station::Request& request) override {
    if (!failure_.empty()) return failed(failure_);
    station::Archive archive;
    station::Request copy = request;
    copy.serialize(archive);
    begin_call(request.call);
    const auto size = static_cast<std::uint32_t>(archive.octets().size());
    std::string octets(sizeof size, '\0');
    std::memcpy(octets.data(), &size, sizeof size);
    octets += archive.octets();
    if (!send_all(octets)) return ended();
    return receive();
  }

 private:
  os::Command command_of(const std::filesystem::path& program, const std::filesystem::path& object) {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw RunError("no socket for a plugin: " + os::system_reason());
    ours_.reset(ends[0]);
    theirs_.reset(ends[1]);
    os::Command command;
    command.arguments = {program.string(), object.string()};
    command.output = theirs_.get();
    // One that hangs does not outlive the station, however that ends.
    command.at_death = SIGKILL;
    command.own_group = true;
    return command;
  }

  static station::Reply failed(std::string failure) {
    station::Reply reply;
    reply.failure = std::move(failure);
    reply.crashed = true;
    return reply;
  }

  void begin_call(station::Call call) {
    most_wall_s_ = call == station::Call::kStep ? patience_.step_wall_s : patience_.wall_s;
    begun_ = Clock::now();
    cpu_begun_s_ = cpu_s();
  }
  [[nodiscard]] double cpu_s() const {
    clockid_t clock{};
    timespec used{};
    if (clock_getcpuclockid(process_.id(), &clock) != 0 || clock_gettime(clock, &used) != 0) return 0;
    return static_cast<double>(used.tv_sec) + static_cast<double>(used.tv_nsec) * 1e-9;
  }
  [[nodiscard]] bool is_too_long() const {
    return cpu_s() - cpu_begun_s_ > patience_.cpu_s ||
           std::chrono::duration<double>(Clock::now() - begun_).count() > most_wall_s_;
  }

  [[nodiscard]] bool send_all(const std::string& octets) {
    std::size_t done = 0;
    while (done < octets.size()) {
      const ssize_t sent = send(ours_.get(), octets.data() + done, octets.size() - done, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return false;
      done += static_cast<std::size_t>(sent);
    }
    return true;
  }

  /// Until `count` octets are there.
  [[nodiscard]] Wait read_all(char* to, std::size_t count, bool limited = true) {
    const auto asked = Clock::now();
    while (count > 0) {
      pollfd end{ours_.get(), POLLIN, 0};
      const int ready = ::poll(&end, 1, kPoll_ms);
      if (ready < 0 && errno != EINTR) return Wait::kEnded;
      if (ready > 0) {
        const ssize_t got = recv(ours_.get(), to, count, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return Wait::kEnded;
        to += got;
        count -= static_cast<std::size_t>(got);
        continue;
      }
      const double waited_s = std::chrono::duration<double>(Clock::now() - asked).count();
      if (limited ? is_too_long() : waited_s > kLastWord_s) return Wait::kTooLong;
      if (patience_.while_waiting) patience_.while_waiting();
    }
    return Wait::kReady;
  }

  station::Reply receive() {
    std::uint32_t size = 0;
    Wait wait = read_all(reinterpret_cast<char*>(&size), sizeof size);  // NOLINT(*-reinterpret-cast)
    if (wait == Wait::kTooLong) return hung();
    if (wait == Wait::kEnded) return ended();
    if (size == kLastWordMark) return crashed();
    if (size > kLongestReply) return give_up("it wrote over its own connection to the station");
    std::string octets(size, '\0');
    wait = read_all(octets.data(), octets.size());
    if (wait == Wait::kTooLong) return hung();
    if (wait == Wait::kEnded) return ended();
    station::Archive archive(std::move(octets));
    station::Reply reply;
    try {
      reply.serialize(archive);
    } catch (const std::exception&) {
      return give_up("it wrote over its own connection to the station");
    }
    return reply;
  }

  [[nodiscard]] std::string place() {
    LastWord word{};
    if (read_all(reinterpret_cast<char*>(&word), sizeof word, false) != Wait::kReady)  // NOLINT(*-reinterpret-cast)
      return {};
    word.function.back() = '\0';
    last_signal_ = word.signal;
    std::string place = word.function.data();
    if (word.robot >= 0) place += " of robot " + std::to_string(word.robot);
    return place;
  }

  station::Reply crashed() {
    const std::string where = place();
    const std::string what = last_signal_ == 0 ? "it ended its process" : os::signal_name(last_signal_);
    return give_up(where.empty() ? what : where + ": " + what);
  }

  station::Reply hung() {
    process_.signal(SIGUSR1);
    std::uint32_t mark = 0;
    std::string where;
    if (read_all(reinterpret_cast<char*>(&mark), sizeof mark, false) ==
            Wait::kReady &&  // NOLINT(*-reinterpret-cast)
        mark == kLastWordMark)
      where = place();
    return give_up((where.empty() ? "" : where + ": ") + "it did not return");
  }

  station::Reply ended() {
    const os::ProcessEnd end = process_.wait();
    return give_up(end.signal != 0 ? os::signal_name(end.signal) : "it ended its process");
  }

  station::Reply give_up(const std::string& failure) {
    failure_ = failure;
    process_.signal(SIGKILL);
    return failed(failure);
  }

  const PluginPatience patience_;
  double most_wall_s_ = 0;        // of the present call
  os::Descriptor ours_, theirs_;  // before process_, whose start uses them
  os::Process process_;
  Clock::time_point begun_{};
  double cpu_begun_s_ = 0;
  int last_signal_ = 0;
  std::string failure_;
};

}  // namespace

std::unique_ptr<PluginHost> start_plugin_process(const std::filesystem::path& program,
                                                 const std::filesystem::path& object, PluginPatience patience) {
  return std::make_unique<PluginProcess>(program, object, std::move(patience));
}

}  // namespace kilotwin::ark
