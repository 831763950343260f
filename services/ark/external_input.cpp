#include "services/ark/external_input.hpp"

#include <algorithm>

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
  switch (sample.command) {
    case 0: directive.packet.command = OverheadCommand::kStop; break;
    case 2: directive.packet.command = OverheadCommand::kRepeat; break;
    case 6: directive.packet.command = OverheadCommand::kOnce; break;
    default: return;
  }
  std::copy_n(sample.message, directive.packet.message.size(), directive.packet.message.begin());
  waiting_.push_back(directive);
}

}  // namespace kilotwin::ark
