#include "clients/cli/run_control.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
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

/// A robot counts as placed where it is this near: it may have moved on before the state that is seen.
constexpr double kNear_mm = 20;

Clock::time_point deadline(Seconds patience) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(patience);
}

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
      relocations_(participant_, topics::relocations()),
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

template <class Sample>
void RunControl::write(dds::Writer<Sample>& writer, Sample& sample, Clock::time_point until) {
  while (writer.readers() == 0) {
    if (Clock::now() > until || interrupted() != 0)
      throw RunError(
          fmt::format("the run on domain {} takes no commands; its station has not been found", domain_));
    std::this_thread::sleep_for(kPoll);
  }
  client_.copy(sample.client, sizeof sample.client - 1);
  {
    const std::lock_guard lock(mutex_);
    sample.run = status_ ? status_->run : 0;
  }
  sample.request = ++requests_;
  writer.write(sample);
  if (!writer.flush(std::max(0.1, Seconds(until - Clock::now()).count())))
    throw RunError(fmt::format("the station of the run on domain {} does not answer", domain_));
}

void RunControl::send(kilotwin_open_RunCommand command, std::uint32_t steps, Seconds patience) {
  PublicRunControl sample{};
  sample.command = command;
  sample.steps = steps;
  write(control_, sample, deadline(patience));
}

void RunControl::place(const Relocation& where, Seconds patience) {
  const auto until = deadline(patience);
  std::mutex mutex;
  std::condition_variable seen;
  bool is_there = false;
  const dds::Reader<PublicSwarmState> swarm(
      participant_, topics::swarm(), [&](const PublicSwarmState& sample, dds::SampleState state) {
        const auto& [movable, body, pose] = where;
        const auto& x = movable ? sample.movable_x_mm : sample.x_mm;
        const auto& y = movable ? sample.movable_y_mm : sample.y_mm;
        if (!state.valid || body >= x._length || body >= y._length) return;
        const std::lock_guard lock(mutex);
        is_there = is_there || std::hypot(x._buffer[body] - pose.x_mm, y._buffer[body] - pose.y_mm) < kNear_mm;
        seen.notify_one();
      });
  PublicRelocation sample{};
  sample.movable = where.movable;
  sample.body = where.body;
  sample.x_mm = where.pose.x_mm;
  sample.y_mm = where.pose.y_mm;
  sample.heading_rad = where.pose.heading_rad;
  write(relocations_, sample, until);
  const auto paused = [this] {
    const std::lock_guard lock(mutex_);
    return status_->phase == kilotwin_open_PAUSED;
  };
  std::unique_lock lock(mutex);
  while (!is_there && !paused()) {
    if (Clock::now() > until)
      throw RunError(fmt::format("{} {} did not come to stand there within {:g} s; the station's log says why",
                                 where.movable ? "movable body" : "robot", where.body, patience.count()));
    if (interrupted() != 0) throw RunError("interrupted");
    seen.wait_for(lock, kPoll);
  }
}

RunControl::Status RunControl::await(const std::function<bool(const Status&)>& done, const std::string& what,
                                     Seconds patience, const std::string& hint) {
  const auto until = deadline(patience);
  std::unique_lock lock(mutex_);
  while (!done(*status_) && !is_over(status_->phase) && !gone_) {
    if (Clock::now() > until) {
      throw RunError(fmt::format("the run {} did not {} within {:g} s; it is at {:.3f} s{}{}{}", status_->name,
                                 what, patience.count(), status_->simulated_s, status_->note[0] == '\0' ? "" : ": ",
                                 status_->note, hint));
    }
    if (interrupted() != 0) throw RunError("interrupted");
    arrived_.wait_for(lock, kPoll);
  }
  return *status_;
}

}  // namespace kilotwin::cli
