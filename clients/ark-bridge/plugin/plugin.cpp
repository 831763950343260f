// An experiment of ARK that joins ARK's robots to a run. ARK loads the library and calls createExpt(). Settings come from the
// environment that ARK was started in: KILOTWIN_EXPERIMENT, KILOTWIN_DOMAIN, KILOTWIN_DOOR, KILOTWIN_PEERS.
#include <kilobotexperiment.h>

#include <QLabel>
#include <QPointer>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "clients/ark-bridge/bridge.hpp"
#include "core/base/error.hpp"
#include "core/experiment/load.hpp"

namespace {

namespace doors = kilotwin::doors;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string{} : std::string{value};
}

kilotwin::dds::Transport transport_of_environment() {
  kilotwin::dds::Transport transport;
  const std::string domain = variable("KILOTWIN_DOMAIN");
  const char* const last = domain.data() + domain.size();
  const auto [end, error] = std::from_chars(domain.data(), last, transport.domain);
  if (error != std::errc() || end != last || transport.domain > kilotwin::dds::kLastDomain) {
    throw kilotwin::UserError("KILOTWIN_DOMAIN is \"" + domain + "\"; it takes the run's DDS domain, 0 to " +
                              std::to_string(kilotwin::dds::kLastDomain));
  }
  std::istringstream peers(variable("KILOTWIN_PEERS"));
  for (std::string peer; peers >> peer;) transport.peers.push_back(peer);
  return transport;
}

std::unique_ptr<doors::ArkBridge> bridge_of_environment() {
  const std::string file = variable("KILOTWIN_EXPERIMENT");
  if (file.empty())
    throw kilotwin::UserError("KILOTWIN_EXPERIMENT is not set; it takes the experiment file of the run");
  const kilotwin::LoadedExperiment loaded = kilotwin::load_experiment(file);
  return std::make_unique<doors::ArkBridge>(
      doors::open_door(loaded, kilotwin::proto::Door::kArk, variable("KILOTWIN_DOOR")), transport_of_environment());
}

class BridgeExperiment : public KilobotExperiment {
 public:
  BridgeExperiment() {
    // ARK must live on, whatever is wrong here.
    try {
      bridge_ = bridge_of_environment();
      serviceInterval = static_cast<int>(bridge_->door().settings.ark().interval_ms());
    } catch (const std::exception& error) {
      fault_ = error.what();
      qWarning("kilotwin: %s", error.what());
    }
  }

  QWidget* createGUI() override {
    label_ = new QLabel(status());
    label_->setWordWrap(true);
    return label_;
  }

  void initialise(bool /*isResume*/) override { emit getInitialKilobotStates(); }

  void run() override {
    if (!bridge_) return;
    try {
      robots_.clear();
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      emit updateKilobotStates();  // ARK answers by updateKilobotState() for each robot
      bridge_->publish(robots_, std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
      for (const doors::ArkOrder& order : bridge_->take())
        std::visit([this](const auto& each) { send(each); }, order);
    } catch (const std::exception& error) {
      fault_ = error.what();
    }
    if (label_) label_->setText(status());
  }

 protected:
  void setupInitialKilobotState(Kilobot robot) override { updateKilobotState(robot); }
  void updateKilobotState(Kilobot robot) override {
    const QPointF position = robot.getPosition(), velocity = robot.getVelocity();
    robots_.push_back({robot.getID(), position.x(), position.y(), velocity.x(), velocity.y(),
                       static_cast<int>(robot.getLedColour())});
  }

 private:
  /// The type of a broadcast that ends broadcasts.
  static constexpr std::uint8_t kStopType = 250;

  void send(const doors::ArkSignal& signal) {
    kilobot_message message{};
    message.id = signal.id & 0x3ffU;
    message.type = signal.type & 0xfU;
    message.data = signal.data & 0x3ffU;
    emit signalKilobot(message);
  }
  void send(const doors::ArkBroadcast& broadcast) {
    kilobot_broadcast message;
    message.type = broadcast.type;
    for (const std::uint8_t octet : broadcast.data) message.data.push_back(octet);
    emit broadcastMessage(message);
  }
  void send(const doors::ArkStop& /*stop*/) {
    kilobot_broadcast message;
    message.type = kStopType;
    emit broadcastMessage(message);
  }

  [[nodiscard]] QString status() {
    std::string text;
    if (bridge_) {
      text = "Kilotwin: " + std::string(bridge_->joined() ? "joined a run; " : "waits for a run; ") +
             bridge_->in_words();
    }
    if (!fault_.empty()) text += (text.empty() ? "Kilotwin: " : "\n") + fault_;
    return QString::fromStdString(text);
  }

  std::unique_ptr<doors::ArkBridge> bridge_;
  std::string fault_;
  std::vector<doors::ArkRobot> robots_;
  QPointer<QLabel> label_;
};

}  // namespace

extern "C" Q_DECL_EXPORT KilobotExperiment* createExpt() { return new BridgeExperiment(); }
