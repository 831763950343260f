/// RecordedRun: a recording at any time, by the index of its states. A recording may still grow.
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "clients/recorder/reader.hpp"
#include "clients/recorder/run_directory.hpp"
#include "clients/recorder/state_index.hpp"
#include "clients/view/frame_code.hpp"
#include "clients/view/gateway.hpp"
#include "clients/view/light_picture.hpp"
#include "clients/view/outside.hpp"
#include "clients/view/recorded_curves.hpp"
#include "clients/view/robot_messages.hpp"
#include "clients/view/run_text.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::view {

class RecordedRun : public Answers {
 public:
  /// Opens a run directory, or a recording alone. Throws UserError if it is none, or has no state.
  explicit RecordedRun(const std::filesystem::path& run);
  ~RecordedRun() override;

  /// The message of type "run".
  [[nodiscard]] std::string text() const;
  /// Looks for new states. Returns a message of type "extent" where there are some, else empty.
  [[nodiscard]] std::string grown();
  [[nodiscard]] std::size_t states() const;
  /// Lines of the residual monitor up to a tick.
  [[nodiscard]] std::vector<std::string> alarms_until(std::int64_t tick) const;
  /// The events SENT or RECEIVED are recorded.
  [[nodiscard]] bool counts_messages() const { return messages_.any(); }
  [[nodiscard]] std::uint64_t run() const { return reader_.header().run(); }
  [[nodiscard]] const std::string& name() const { return reader_.header().name(); }
  [[nodiscard]] std::uint32_t robots() const { return reader_.header().robots(); }

  // Answers.
  [[nodiscard]] std::string frame_at(std::int64_t tick, std::uint32_t request) override;
  [[nodiscard]] std::uint64_t floors_version(std::int64_t tick) override;
  [[nodiscard]] std::string floors_at(std::int64_t tick) override;
  [[nodiscard]] std::string light(std::int64_t tick) override;
  [[nodiscard]] std::string trail(std::uint32_t robot, std::int64_t tick) override;
  [[nodiscard]] std::string robot(std::uint32_t robot, std::int64_t tick) override;
  /// The same, where the caller knows whom it has heard lately.
  [[nodiscard]] std::string robot(std::uint32_t robot, std::int64_t tick,
                                  const std::optional<std::set<std::uint32_t>>& lately);
  [[nodiscard]] std::string plots() override;
  [[nodiscard]] std::string plot(std::uint32_t number, std::optional<std::uint32_t> robot) override;
  [[nodiscard]] std::string program(std::uint32_t robot, std::int64_t tick) override;
  [[nodiscard]] std::string outside(std::int64_t tick) override;
  [[nodiscard]] std::string flights(std::int64_t from, std::int64_t tick) override;
  [[nodiscard]] std::string work() override;
  [[nodiscard]] std::string marks() override;
  [[nodiscard]] std::string steer(const Request&) override;

 private:
  [[nodiscard]] const proto::StateRecord* state(std::size_t number);
  [[nodiscard]] const proto::Record* record_at(std::uint64_t offset);
  template <class Take>
  [[nodiscard]] bool each_event_back(std::uint32_t kind, std::int64_t from, std::int64_t tick, const Take& take);
  struct WholeRun {
    std::uint32_t robot;
    std::string text;  ///< empty: the run goes on
  };
  [[nodiscard]] std::string of_whole_run(std::uint32_t robot);
  [[nodiscard]] std::set<std::uint32_t> heard_lately(std::uint32_t robot, std::int64_t tick);
  [[nodiscard]] std::vector<TrackedPlace> places_at(std::int64_t tick);
  [[nodiscard]] std::vector<ShownPacket> packets_until(std::int64_t tick);

  mutable std::mutex mutex_;  // the gateway's thread answers, another one looks whether the recording grows
  recorder::Reader reader_;
  recorder::StateIndex index_;
  ResidualCurves residuals_{reader_.path().parent_path()};
  RecordedCurves curves_{reader_, index_, residuals_};
  RobotMessages messages_{reader_, index_};
  std::filesystem::path logs_of_;  // the run directory; empty: the recording stands alone
  std::unique_ptr<const proto::Experiment> experiment_;
  std::shared_ptr<const RunPlan> plan_;  // nullptr: the recording does not say enough
  std::optional<LightPicture> light_;    // made when it is asked for
  std::vector<Mark> marks_;              // of the inputs that were read
  std::size_t inputs_read_ = 0;
  std::list<WholeRun> whole_runs_;  // the one that was used last is the first
  std::string work_;                // the answer, once the run has ended
  std::vector<bool> firmware_;
  bool federated_ = false;
  PositionGrid grid_;
};

}  // namespace kilotwin::view
