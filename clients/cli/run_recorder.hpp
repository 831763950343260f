/// RunRecorder: a RunObserver that records a run, and writes summary and picture at its end.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "clients/cli/recorded_state.hpp"
#include "clients/cli/run_monitor.hpp"
#include "clients/recorder/displacement.hpp"
#include "clients/recorder/run_directory.hpp"
#include "clients/recorder/summary.hpp"
#include "clients/recorder/writer.hpp"
#include "core/federation/checkpoint.hpp"
#include "core/federation/run_observer.hpp"
#include "core/observations/events.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

class RunRecorder : public RunObserver {
 public:
  /// `resumed`: the checkpoint from which the run starts, if any. `on_idle` receives the progress of the run; it may be empty. The
  /// recording continues that of an earlier attempt at this run, if there was one (recovery.hpp).
  RunRecorder(const RunPlan& plan, const recorder::RunDirectory& directory,
              const std::optional<Checkpoint>& resumed, std::function<void(const RunProgress&)> on_idle);
  /// Compares tracked robots with the model from now on. Throws UserError if there is nothing to watch.
  void monitor(const MonitorOptions& options) { monitor_.emplace(plan_, options, directory_.alarms()); }

  void state(Tick, const SwarmView&, bool last) override;
  void hash(Tick, std::uint64_t chain) override;
  void input(const Directive&) override;
  void floor(Tick, const FloorPicture&) override;
  void tracker_sample(Tick tick, const TrackerSample& sample) override;
  void observed(const proto::Observations& observations) override;
  void saved() override;
  void idle(const RunProgress&) override;

  /// Ends the recording, and writes summary and picture. `start_s`: wall time from the command to the first tick.
  recorder::Summary finish(const RunTotals& totals, double start_s);
  /// Time of the first tick, steady clock.
  [[nodiscard]] std::chrono::steady_clock::time_point first_tick_at() const { return first_tick_at_; }

 private:
  void take_over(const std::filesystem::path& earlier, Tick until);
  void take_event(const proto::EventRecord& event);
  void record_counts(const RunTotals& totals);
  [[nodiscard]] recorder::Summary summary_of(const RunTotals& totals, double start_s);

  const RunPlan& plan_;
  const recorder::RunDirectory directory_;
  const proto::RecordingHeader header_;
  recorder::Writer writer_;
  recorder::RecordingSchedule when_;
  recorder::DisplacementObserver displacement_;
  std::function<void(const RunProgress&)> on_idle_;
  RecordedState state_;
  ChangeObserver changes_;
  std::vector<recorder::Summary::Failure> failures_;
  Tick next_{0};
  Tick recovered_from_{0};
  bool any_state_ = false;
  std::optional<RunMonitor> monitor_;
  bool inputs_wait_ = false;  ///< inputs wait to be flushed
  std::chrono::steady_clock::time_point first_tick_at_{};
};

[[nodiscard]] proto::InputRecord to_record(const Directive& directive);
/// Whether a directive affects results, so that a replay must repeat it. Pauses and checkpoints do not, and the recording's end
/// replaces a stop.
[[nodiscard]] inline bool changes_results(const Directive& directive) {
  return directive.kind == DirectiveKind::kOverheadInput || directive.kind == DirectiveKind::kMembership ||
         directive.kind == DirectiveKind::kRelocation;
}
[[nodiscard]] Directive from_record(const proto::InputRecord& record);

}  // namespace kilotwin::cli
