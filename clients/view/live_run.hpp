/// LiveRun: runs on a domain as they happen. States come from an observer, which can never slow a run; requests go out as
/// RunControl, as any other program's would. Curves, variables, logs, floors and counts of messages come from the run's recording
/// while it grows, where its directory is given. Else observables of the experiment are computed of the states.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "clients/observe/observer.hpp"
#include "clients/view/flights.hpp"
#include "clients/view/frame_code.hpp"
#include "clients/view/gateway.hpp"
#include "clients/view/light_picture.hpp"
#include "clients/view/live_observables.hpp"
#include "clients/view/recorded_run.hpp"
#include "clients/view/work.hpp"
#include "core/federation/topics.hpp"

namespace kilotwin::view {

class LiveRun : public Answers {
 public:
  /// `directory`: of the run that is expected; empty: not known. `tells`: lines about the beginning and the end of runs, on
  /// stderr.
  LiveRun(const dds::Transport& transport, std::filesystem::path directory, bool tells);
  ~LiveRun() override;

  /// Looks at the domain for up to 50 ms and passes on what is new. Call it again and again.
  void serve(Gateway& gateway);
  /// The last run that was seen to end; 0: none.
  [[nodiscard]] std::uint64_t ended_run() const { return ended_run_; }

  // Answers.
  [[nodiscard]] std::string frame_at(std::int64_t, std::uint32_t) override { return {}; }
  [[nodiscard]] std::uint64_t floors_version(std::int64_t tick) override;
  [[nodiscard]] std::string floors_at(std::int64_t tick) override;
  [[nodiscard]] std::string light(std::int64_t tick) override;
  [[nodiscard]] std::string trail(std::uint32_t, std::int64_t) override { return {}; }
  [[nodiscard]] std::string robot(std::uint32_t robot, std::int64_t tick) override;
  [[nodiscard]] std::string plots() override;
  [[nodiscard]] std::string plot(std::uint32_t number, std::optional<std::uint32_t> robot) override;
  [[nodiscard]] std::string program(std::uint32_t robot, std::int64_t tick) override;
  [[nodiscard]] std::string outside(std::int64_t tick) override;
  [[nodiscard]] std::string flights(std::int64_t from, std::int64_t tick) override;
  [[nodiscard]] std::string work() override;
  [[nodiscard]] std::string marks() override;
  [[nodiscard]] std::string steer(const Request& request) override;

 private:
  struct SeenFrame {
    TrackerSample sample;
    std::chrono::steady_clock::time_point seen;
  };
  void begin(Gateway& gateway);
  void post_state(Gateway& gateway);
  [[nodiscard]] bool runs_fast() const;
  void follow_recording();
  void on_tracker_frame(const PublicTrackerFrame& frame);
  void on_packet(const PublicStationPacket& packet);
  void on_metrics(const WireMetrics& metrics);
  [[nodiscard]] std::shared_ptr<const RunPlan> plan();
  [[nodiscard]] std::string place(const Relocation& place);
  [[nodiscard]] std::shared_ptr<RecordedRun> recording();
  void post_status(Gateway& gateway, bool ended);

  using Clock = std::chrono::steady_clock;
  const std::filesystem::path directory_;
  const bool tells_;
  observe::Observer observer_;
  dds::Participant participant_;
  dds::Writer<PublicRunControl> control_;
  dds::Writer<PublicOverheadPacket> overhead_;
  dds::Writer<PublicRelocation> relocations_;
  std::atomic<std::uint64_t> run_{0};  // at hand; 0: none
  std::mutex mutex_;
  PublicRunStatus status_{};  // the newest, of any run; guarded by mutex_
  std::uint64_t status_number_ = 0;
  std::shared_ptr<RecordedRun> recording_;  // of the run at hand; guarded by mutex_
  Clock::time_point look_{};                // when to look for new records
  std::shared_ptr<const RunPlan>
      plan_;  // of the run at hand; nullptr: not known; guarded by mutex_, like what follows
  std::map<std::string, SeenFrame> frames_;  // the newest of each tracker
  std::deque<ShownPacket> packets_;          // the newest
  LiveWork live_work_;
  LiveFlights live_flights_;
  std::optional<LiveObservables> observables_;  // where the directory is not known
  std::vector<double> x_mm_, y_mm_;             // of the newest state, where the run has light
  Clock::time_point flights_until_{};           // until then messages are wanted
  dds::Reader<PublicRunStatus> statuses_;
  dds::Reader<PublicTrackerFrame> tracker_frames_;
  dds::Reader<PublicStationPacket> station_packets_;
  dds::Reader<WireMetrics> metrics_;

  std::uint64_t posted_status_ = 0, ended_run_ = 0;
  Clock::time_point next_post_{};  // of a state
  bool unposted_ = false;          // the newest state
  PositionGrid grid_;
  std::optional<LightPicture> light_;  // of the gateway's thread, like what follows; of the run light_of_
  std::uint64_t light_of_ = 0;
  const std::string client_;   // how requests are signed
  std::uint32_t request_ = 0;  // of the gateway's thread
};

}  // namespace kilotwin::view
