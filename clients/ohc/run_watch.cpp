#include "clients/ohc/run_watch.hpp"

#include <fmt/format.h>

#include "core/base/say.hpp"

namespace kilotwin::ohc {

RunWatch::RunWatch(const dds::Participant& participant)
    : reader_(participant, topics::run_status(), [this](const PublicRunStatus& sample, dds::SampleState state) {
        const std::lock_guard lock(mutex_);
        if (state.valid && state.alive) {
          status_ = sample;
          heard_ = Clock::now();
        } else if (status_ && status_->run == sample.run) {
          status_.reset();
        }
      }) {}

bool RunWatch::has_run() const {
  return status_ && status_->phase != kilotwin_open_ENDED && status_->phase != kilotwin_open_BROKEN;
}

std::optional<std::string> RunWatch::run() const {
  const std::lock_guard lock(mutex_);
  if (!has_run()) return std::nullopt;
  return status_->name;
}

std::optional<std::chrono::steady_clock::time_point> RunWatch::heard() const {
  const std::lock_guard lock(mutex_);
  if (!has_run()) return std::nullopt;
  return heard_;
}

bool RunAnnouncer::look() {
  const std::optional<std::string> run = watch_.run();
  const std::string name = run.value_or("");
  if (said_ && *said_ == name) return run.has_value();
  said_ = name;
  if (run) {
    say(fmt::format("kilotwin: domain {}: run {}", domain_, one_line(name, 128)));
  } else {
    say(fmt::format(
        "kilotwin: domain {}: waiting for a run; start one with: kilotwin run EXPERIMENT --pace 1 --domain {}",
        domain_, domain_));
  }
  return run.has_value();
}

}  // namespace kilotwin::ohc
