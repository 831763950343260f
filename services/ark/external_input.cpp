#include "services/ark/external_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_check.hpp"

namespace kilotwin::ark {

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

bool ExternalInput::is_new(const std::string& client, std::uint32_t request) {
  const auto [entry, inserted] = last_request_.try_emplace(client, request);
  if (!inserted && entry->second == request) return false;
  entry->second = request;
  return true;
}

void ExternalInput::on_run_control(const PublicRunControl& sample) {
  const std::lock_guard lock(mutex_);
  if (!ours(sample.run) || !is_new(std::string("control ") + sample.client, sample.request)) return;
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
    default: return;
  }
  waiting_.push_back(directive);
}

void ExternalInput::on_overhead_packet(const PublicOverheadPacket& sample) {
  const std::lock_guard lock(mutex_);
  if (!ours(sample.run) || !is_new(std::string("overhead ") + sample.client, sample.request)) return;
  Directive directive;
  directive.kind = DirectiveKind::kOverheadInput;
  directive.packet.command = static_cast<OverheadCommand>(sample.command);
  if (!is_known(directive.packet.command)) return;
  std::copy_n(sample.message, directive.packet.message.size(), directive.packet.message.begin());
  std::copy_n(sample.rest, directive.packet.rest.size(), directive.packet.rest.begin());
  waiting_.push_back(directive);
}

void ExternalInput::on_relocation(const PublicRelocation& sample) {
  const std::lock_guard lock(mutex_);
  if (!ours(sample.run) || !is_new(std::string("relocation ") + sample.client, sample.request)) return;
  Directive directive;
  directive.kind = DirectiveKind::kRelocation;
  const double heading = wrapped(std::remainder(sample.heading_rad, 2 * kPi));
  directive.relocation = {sample.movable, sample.body, {sample.x_mm, sample.y_mm, heading}};
  if (const char* const why = defect(directive.relocation, plan_)) {
    say(fmt::format("the request of {} to place {} {} elsewhere is ignored: {}", sample.client,
                    sample.movable ? "movable body" : "robot", sample.body, why));
    return;
  }
  waiting_.push_back(directive);
}

}  // namespace kilotwin::ark
