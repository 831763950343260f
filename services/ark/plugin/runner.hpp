/// Runs one plugin: answers the station's requests by calls of the plugin's functions.
#pragma once

#include <memory>
#include <set>

#include "core/random/random.hpp"
#include "wire.hpp"

namespace kilotwin::station {

/// The function of a plugin that runs, for the line that tells of a crash. Read in a signal handler.
struct RunningCall {
  const char* function = nullptr;  ///< nullptr: none
  std::int32_t robot = -1;         ///< -1: of no robot
};

class Runner final : public Services {
 public:
  explicit Runner(std::unique_ptr<KilobotExperiment> experiment);
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;
  ~Runner() override;

  /// An exception of the plugin becomes the reply's `failure`. Throws nothing.
  [[nodiscard]] Reply answer(const Request& request);
  [[nodiscard]] const volatile RunningCall& running() const { return running_; }

  // Services
  void send(const kilobot_message& message) override;
  void broadcast(const kilobot_broadcast& message) override;
  void setEnvironment(KilobotEnvironment* environment) override;
  void initialStates() override;
  void updateStates() override;
  void complete() override { reply_.complete = true; }
  void report(const std::string& json, const std::string& line) override { reply_.reports.push_back({json, line}); }
  [[nodiscard]] std::optional<std::string> parameter(const std::string& name) override;
  [[nodiscard]] double uniform() override;
  [[nodiscard]] double normal() override;
  [[nodiscard]] std::uint32_t robots() const override { return static_cast<std::uint32_t>(environment_of_.size()); }
  [[nodiscard]] Point arenaSize_mm() const override { return arena_mm_; }
  void useArkPictureFrame() override { picture_frame_ = true; }

 private:
  void set_up(const Request& request);
  void step(const Request& request);
  void save();
  void load(const Request& request);
  [[nodiscard]] Kilobot seen(std::uint32_t robot) const;
  [[nodiscard]] std::string log_row(std::uint32_t robot, double time_s);
  void paint();
  /// Counted from 1 in the order in which the plugin names them; 0: none.
  std::uint32_t index_of(KilobotEnvironment* environment);

  std::unique_ptr<KilobotExperiment> experiment_;
  std::map<std::string, std::string> parameters_;
  std::set<std::string> asked_parameters_;
  std::vector<KilobotEnvironment*> environments_;    ///< all that were named
  std::vector<KilobotEnvironment*> environment_of_;  ///< per robot; nullptr: none
  Random random_{0};
  std::uint32_t index_ = 0;
  Point arena_mm_;
  bool picture_frame_ = false, initial_states_given_ = false;

  // Of the request at hand.
  const Request* request_ = nullptr;
  Reply reply_;
  std::uint32_t draws_ = 0;
  std::int64_t robot_at_hand_ = -1;
  volatile RunningCall running_;
};

}  // namespace kilotwin::station
