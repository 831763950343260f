#include "clients/cli/run_control.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr auto kSayAfter = std::chrono::seconds(1);
constexpr auto kPoll = std::chrono::milliseconds(20);

/// Requests count per client, so every process is a client of its own.
std::string client_name() {
  char host[32] = "";
  ::gethostname(host, sizeof host - 1);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return fmt::format("control {} {} {}", host, ::getpid(),
                     std::chrono::duration_cast<std::chrono::microseconds>(now).count() % 1'000'000'000);
}

}  // namespace

RunControl::RunControl(std::uint32_t domain)
    : domain_(domain),
      client_(client_name()),
      participant_({domain, {}}),
      control_(participant_, topics::run_control()),
      reader_(participant_, topics::run_status(),
              [this](const Status& sample, dds::SampleState state) { on_status(sample, state); }) {}

void RunControl::on_status(const Status& sample, dds::SampleState state) {
  const std::lock_guard lock(mutex_);
  if (!state.valid || !state.alive) {
    gone_ = gone_ || (status_ && status_->run == sample.run && !state.alive);
  } else if (status_ && status_->run != sample.run && !is_over(status_->phase) && !gone_) {
    several_ = several_ || !is_over(sample.phase);
  } else if (!status_ || status_->run == sample.run || is_over(status_->phase) || gone_) {
    status_ = sample;
    gone_ = false;
  }
  arrived_.notify_one();
}

RunControl::Status RunControl::find(Seconds patience) {
  const auto begun = Clock::now();
  bool said = false;
  std::unique_lock lock(mutex_);
  while (!status_) {
    const auto waited = Clock::now() - begun;
    if (waited > patience) {
      throw RunError(
          fmt::format("no run on domain {} within {:g} s; `kilotwin run` prints the domain that it took, and "
                      "--domain N chooses one",
                      domain_, patience.count()));
    }
    if (interrupted() != 0) throw RunError("interrupted");
    if (!said && waited > kSayAfter) {
      said = true;
      say(fmt::format("kilotwin: waiting for a run on domain {}", domain_));
    }
    arrived_.wait_for(lock, kPoll);
  }
  if (several_) throw RunError(fmt::format("domain {} has two runs; stop one of them", domain_));
  return *status_;
}

void RunControl::send(kilotwin_open_RunCommand command, std::uint32_t steps, Seconds patience) {
  const auto until = Clock::now() + patience;
  while (control_.readers() == 0) {
    if (Clock::now() > until || interrupted() != 0)
      throw RunError(
          fmt::format("the run on domain {} takes no commands; its station has not been found", domain_));
    std::this_thread::sleep_for(kPoll);
  }
  PublicRunControl sample{};
  client_.copy(sample.client, sizeof sample.client - 1);
  {
    const std::lock_guard lock(mutex_);
    sample.run = status_ ? status_->run : 0;
  }
  sample.request = ++requests_;
  sample.command = command;
  sample.steps = steps;
  control_.write(sample);
  if (!control_.flush(std::max(0.1, Seconds(until - Clock::now()).count())))
    throw RunError(fmt::format("the station of the run on domain {} does not answer", domain_));
}

RunControl::Status RunControl::await(const std::function<bool(const Status&)>& done, const std::string& what,
                                     Seconds patience) {
  const auto until = Clock::now() + patience;
  std::unique_lock lock(mutex_);
  while (!done(*status_) && !is_over(status_->phase) && !gone_) {
    if (Clock::now() > until) {
      throw RunError(fmt::format("the run {} did not {} within {:g} s; it is at {:.3f} s{}{}", status_->name, what,
                                 patience.count(), status_->simulated_s, status_->note[0] == '\0' ? "" : ": ",
                                 status_->note));
    }
    if (interrupted() != 0) throw RunError("interrupted");
    arrived_.wait_for(lock, kPoll);
  }
  return *status_;
}

}  // namespace kilotwin::cli
