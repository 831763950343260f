#include "services/ark/external_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_check.hpp"

namespace kilotwin::ark {
namespace {

/// Far more than people and programs send between two ticks. Requests beyond it are ignored.
constexpr std::size_t kMostRequests = 1000;
/// Of all topics. The requests of each are remembered for the whole run.
constexpr std::size_t kMostClients = 1000;
constexpr std::size_t kLongestName = 64;

}  // namespace

ExternalInput::ExternalInput(const RunPlan& plan, const dds::Participant& participant)
    : plan_(plan),
      run_control_(participant, topics::run_control(),
                   [this](const PublicRunControl& sample, dds::SampleState state) {
                     if (state.valid) on_run_control(sample);
                   }),
      overhead_packets_(participant, topics::overhead_packets(),
                        [this](const PublicOverheadPacket& sample, dds::SampleState state) {
                          if (state.valid) on_overhead_packet(sample);
                        }),
      relocations_(participant, topics::relocations(),
                   [this](const PublicRelocation& sample, dds::SampleState state) {
                     if (state.valid) on_relocation(sample);
                   }) {}

std::vector<Directive> ExternalInput::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(waiting_, {});
}

void ExternalInput::note(const std::string& client, std::uint32_t request) {
  if (last_request_.insert_or_assign(client, request).second) clients_.push_back(client);
  if (clients_.size() <= kMostClients) return;
  last_request_.erase(clients_.front());
  clients_.pop_front();
}

template <class Sample, class Make>
void ExternalInput::receive(const std::string& topic, const Sample& sample, Make make) {
  std::string refusal;
  std::optional<std::uint64_t> withheld;
  {
    const std::lock_guard lock(mutex_);
    const std::string client = topic + ' ' + sample.client;
    if (!ours(sample.run)) return;
    if (const auto last = last_request_.find(client); last != last_request_.end() && last->second == sample.request)
      return;
    const std::optional<Directive> directive = make(refusal);
    // However many requests wait, a run can be paused and stopped.
    const bool is_urgent =
        directive && (directive->kind == DirectiveKind::kPause || directive->kind == DirectiveKind::kStop);
    if (directive && waiting_.size() >= kMostRequests && !is_urgent) {
      refusal = fmt::format("{} requests wait already", kMostRequests);
    } else {
      note(client, sample.request);
      if (directive) waiting_.push_back(*directive);
    }
    if (!refusal.empty()) withheld = limit_.pass(LineLimit::Clock::now());
  }
  if (!withheld) return;
  say(fmt::format("a request of {} on the topic {} is ignored: {}{}", one_line(sample.client, kLongestName), topic,
                  refusal, *withheld == 0 ? "" : fmt::format("; before it {} more were ignored", *withheld)));
}

void ExternalInput::on_run_control(const PublicRunControl& sample) {
  receive("run_control", sample, [&](std::string& refusal) -> std::optional<Directive> {
    Directive directive;
    switch (sample.command) {
      case kilotwin_open_PAUSE_RUN: directive.kind = DirectiveKind::kPause; break;
      case kilotwin_open_CONTINUE_RUN: directive.kind = DirectiveKind::kContinue; break;
      case kilotwin_open_STEP_RUN:
        directive.kind = DirectiveKind::kStep;
        directive.steps = sample.steps;
        break;
      case kilotwin_open_STOP_RUN: directive.kind = DirectiveKind::kStop; break;
      case kilotwin_open_CHECKPOINT_RUN: directive.kind = DirectiveKind::kCheckpoint; break;
      default:
        refusal = fmt::format("there is no command {}", static_cast<int>(sample.command));
        return std::nullopt;
    }
    return directive;
  });
}

void ExternalInput::on_overhead_packet(const PublicOverheadPacket& sample) {
  receive("overhead_packets", sample, [&](std::string& refusal) -> std::optional<Directive> {
    Directive directive;
    directive.kind = DirectiveKind::kOverheadInput;
    directive.packet.command = static_cast<OverheadCommand>(sample.command);
    if (!is_known(directive.packet.command)) {
      refusal = fmt::format("there is no packet of type {}", sample.command);
      return std::nullopt;
    }
    std::copy_n(sample.message, directive.packet.message.size(), directive.packet.message.begin());
    std::copy_n(sample.rest, directive.packet.rest.size(), directive.packet.rest.begin());
    return directive;
  });
}

void ExternalInput::on_relocation(const PublicRelocation& sample) {
  receive("relocations", sample, [&](std::string& refusal) -> std::optional<Directive> {
    Directive directive;
    directive.kind = DirectiveKind::kRelocation;
    const double heading = wrapped(std::remainder(sample.heading_rad, 2 * kPi));
    directive.relocation = {sample.movable, sample.body, {sample.x_mm, sample.y_mm, heading}};
    if (const char* const why = defect(directive.relocation, plan_)) {
      refusal = fmt::format("{} {}: {}", sample.movable ? "movable body" : "robot", sample.body, why);
      return std::nullopt;
    }
    return directive;
  });
}

}  // namespace kilotwin::ark
