#include "core/os/children.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::os {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(2);

Descriptor open_log(const std::filesystem::path& log) {
  if (log.empty()) return Descriptor();
  return Descriptor(open(log.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644));
}

Process start_process(const std::string& name, std::vector<std::string> words, const ChildOptions& options,
                      int log) {
  Command command;
  command.arguments = std::move(words);
  command.program = options.program;
  command.output = options.output_to_log && log >= 0 ? log : Command::kDiscard;
  command.errors = log >= 0 ? log : Command::kInherit;
  command.own_group = options.own_group;
  command.at_death = options.at_death;
  try {
    return Process(command);
  } catch (const RunError& error) {
    throw RunError(fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace

std::string in_words(const ProcessEnd& end) {
  return end.signal != 0 ? "was killed by " + signal_name(end.signal)
                         : fmt::format("ended with status {}", end.code);
}

bool crashed(const ProcessEnd& end) {
  constexpr int kSignals[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
  return std::find(std::begin(kSignals), std::end(kSignals), end.signal) != std::end(kSignals);
}

Child::Child(std::string name, std::vector<std::string> words, const ChildOptions& options)
    : name_(std::move(name)),
      tag_(options.tag),
      log_(open_log(options.log)),
      process_(start_process(name_, std::move(words), options, log_.get())) {}

std::string Child::last_line() const {
  char tail[4096];
  struct stat status {};
  if (fstat(log_.get(), &status) != 0) return {};
  const ssize_t octets =
      pread(log_.get(), tail, sizeof tail, std::max<off_t>(0, status.st_size - static_cast<off_t>(sizeof tail)));
  std::string_view text(tail, static_cast<std::size_t>(std::max<ssize_t>(0, octets)));
  text = text.substr(0, text.find_last_not_of('\n') + 1);
  if (const std::size_t before = text.rfind('\n'); before != std::string_view::npos) text.remove_prefix(before + 1);
  return std::string(text);
}

void Children::start(std::string name, std::vector<std::string> words, const ChildOptions& options) {
  running_.emplace_back(std::move(name), std::move(words), options);
}

void Children::signal(std::size_t tag, int number) {
  for (Child& child : running_) {
    if (child.tag() == tag) child.process().signal(number);
  }
}

std::list<Child> Children::reap() {
  const auto now = Clock::now();
  const bool terminate = terminate_at_ && !terminated_ && now >= *terminate_at_;
  const bool kill = kill_at_ && now >= *kill_at_;
  terminated_ = terminated_ || terminate;
  std::list<Child> ended;
  for (auto child = running_.begin(); child != running_.end();) {
    const auto next = std::next(child);
    if (terminate) child->process().signal(SIGTERM);
    if (kill) child->process().signal(SIGKILL);
    if (child->process().poll()) ended.splice(ended.end(), running_, child);
    child = next;
  }
  return ended;
}

void Children::allow_until(Clock::time_point when, std::chrono::milliseconds patience) {
  if (terminate_at_ && *terminate_at_ <= when) return;
  terminate_at_ = when;
  kill_at_ = when + patience;
}

void Children::end() {
  allow_until(Clock::now());
  while (running() > 0) {
    static_cast<void>(reap());
    if (running() > 0) std::this_thread::sleep_for(kPoll);
  }
  terminate_at_ = kill_at_ = std::nullopt;
  terminated_ = false;
}

}  // namespace kilotwin::os
