// Loads the plugin as ARK does, with ARK's own classes of robots and experiments, and stands for ARK's tracker and its overhead
// controller: it answers the signals of the experiment. A participant of its own stands for the run.
// Usage: ark_plugin_host PLUGIN EXPERIMENT. Prints a line for each thing proven; exit status 0: all were.
#include <kilobotexperiment.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QApplication>
#include <QLabel>
#include <QLibrary>
#include <QTimer>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "clients/ark-bridge/bridge.hpp"
#include "services/ark/ark_message.hpp"

namespace {

constexpr int kRobots = 3;
constexpr int kRounds = 500;
constexpr std::chrono::milliseconds kPause{10};

[[noreturn]] void fail(const QString& what) {
  std::fprintf(stderr, "ark_plugin_host: %s\n", qPrintable(what));
  std::exit(1);
}

}  // namespace

/// ARK's tracker and overhead controller, as far as an experiment sees them.
class Station : public QObject {
  Q_OBJECT
 public:
  explicit Station(KilobotExperiment* experiment) {
    for (int i = 0; i < kRobots; ++i) {
      robots_.push_back(std::make_unique<Kilobot>(static_cast<kilobot_id>(i), QPointF(1000 + 50 * i, 900),
                                                  QPointF(0, -1), i == 1 ? RED : BLUE));
      Kilobot* const robot = robots_.back().get();
      connect(robot, SIGNAL(sendUpdateToExperiment(Kilobot*, Kilobot)), experiment,
              SLOT(setupInitialStateRequiredCode(Kilobot*, Kilobot)));
    }
    // As userthread.h of ARK connects an experiment.
    connect(experiment, SIGNAL(updateKilobotStates()), this, SLOT(updateKilobotStates()));
    connect(experiment, SIGNAL(getInitialKilobotStates()), this, SLOT(getInitialKilobotStates()));
    connect(experiment, SIGNAL(broadcastMessage(kilobot_broadcast)), this,
            SLOT(broadcastMessage(kilobot_broadcast)));
    connect(experiment, SIGNAL(signalKilobot(kilobot_message)), this, SLOT(signalKilobot(kilobot_message)));
    connect(this, SIGNAL(startExperiment(bool)), experiment, SLOT(initialise(bool)));
    connect(this, SIGNAL(stopExperiment()), experiment, SLOT(stopExperiment()));
    timer_.setInterval(experiment->serviceInterval);
    connect(&timer_, SIGNAL(timeout()), experiment, SLOT(run()));
  }
  void start() {
    emit startExperiment(false);
    timer_.start();
  }
  void stop() {
    timer_.stop();
    emit stopExperiment();
  }
  std::vector<kilobot_message> signalled;
  std::vector<kilobot_broadcast> broadcasts;

 signals:
  void startExperiment(bool);
  void stopExperiment();

 public slots:
  void updateKilobotStates() {
    for (const auto& robot : robots_) robot->updateExperiment();
  }
  void getInitialKilobotStates() { updateKilobotStates(); }
  void signalKilobot(kilobot_message message) { signalled.push_back(message); }
  void broadcastMessage(kilobot_broadcast message) { broadcasts.push_back(message); }

 private:
  std::vector<std::unique_ptr<Kilobot>> robots_;
  QTimer timer_;
};

namespace {

using namespace kilotwin;

/// The run: reads frames, and sends packets as its station would.
struct Run {
  explicit Run(std::uint32_t domain)
      : participant({domain, {}}),
        station(participant, topics::station_packets()),
        reader(participant, topics::tracker_frames(),
               [this](const PublicTrackerFrame& sample, dds::SampleState state) {
                 if (!state.valid || sample.robot._length != kRobots) return;
                 const std::lock_guard lock(mutex);
                 ++frames;
                 for (std::uint32_t i = 0; i < sample.robot._length; ++i)
                   robots[sample.robot._buffer[i]] = {sample.x_mm._buffer[i], sample.y_mm._buffer[i],
                                                      sample.heading_rad._buffer[i], double(sample.led._buffer[i])};
               }) {}
  void send(std::uint8_t type, const IrMessage& message) {
    PublicStationPacket packet{};
    packet.command = doors::kRepeatCommand;
    std::copy_n(message.begin(), 9, std::begin(packet.message));
    packet.message[9] = type;
    station.write(packet);
  }
  std::mutex mutex;
  int frames = 0;
  std::map<std::uint32_t, std::array<double, 4>> robots;
  dds::Participant participant;
  dds::Writer<PublicStationPacket> station;
  dds::Reader<PublicTrackerFrame> reader;
};

void check_frames(Run& run) {
  const std::lock_guard lock(run.mutex);
  for (int i = 0; i < kRobots; ++i) {
    const auto found = run.robots.find(static_cast<std::uint32_t>(2 + i));
    if (found == run.robots.end()) fail("a robot is missing from the frames");
    const auto& [x, y, heading, led] = found->second;
    if (x != 50 * i || y != 100) fail(QString("robot %1 is at (%2, %3) mm").arg(2 + i).arg(x).arg(y));
    if (std::abs(heading - 1.5707963267948966) > 1e-9) fail(QString("robot %1 heads %2").arg(2 + i).arg(heading));
    if (led != (i == 1 ? 3 : 48)) fail(QString("robot %1 has LED %2").arg(2 + i).arg(led));
  }
  std::printf("frames: %d, with positions, headings and LEDs of all %d robots\n", run.frames, kRobots);
}

/// The run's side: sends packets and reads frames for a while.
int play_run(std::uint32_t domain) {
  Run run(domain);
  for (int round = 0; round < kRounds; ++round) {
    // Robot 3 of the experiment is ARK's robot 1; robot 0 is simulated.
    run.send(0, ark::pack(std::vector<ark::ArkMessage>{{3, 9, 700}, {0, 1, 1}}));
    run.send(42, IrMessage{7});
    std::this_thread::sleep_for(kPause);
    const std::lock_guard lock(run.mutex);
    if (run.frames >= 5 && round >= kRounds / 5) break;
  }
  check_frames(run);
  std::fflush(stdout);
  return 0;
}

void check_orders(const Station& station) {
  bool signalled = false, broadcast = false;
  for (const kilobot_message& message : station.signalled) {
    if (message.id != 1) fail("a message went to a robot that is not real");
    signalled = signalled || (message.type == 9 && message.data == 700);
  }
  for (const kilobot_broadcast& message : station.broadcasts)
    broadcast = broadcast || (message.type == 42 && message.data.size() == 9 && message.data[0] == 7);
  if (!signalled || !broadcast) fail("a message of the station did not come");
  std::printf("orders: %zu messages to robots, %zu broadcasts\n", station.signalled.size(),
              station.broadcasts.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) fail("usage: ark_plugin_host PLUGIN EXPERIMENT");
  const dds::DomainClaim claim = dds::DomainClaim::any();
  // A process of its own: host and plugin have their own copies of core/dds, and Cyclone knows a domain once per process.
  const pid_t run = fork();
  if (run == 0) return play_run(claim.domain());
  qputenv("KILOTWIN_DOMAIN", QByteArray::number(claim.domain()));
  qputenv("KILOTWIN_EXPERIMENT", argv[2]);
  QApplication app(argc, argv);
  QLibrary library(argv[1]);
  using Create = KilobotExperiment* (*)();
  const auto create = reinterpret_cast<Create>(library.resolve("createExpt"));
  if (create == nullptr) fail("createExpt: " + library.errorString());
  const std::unique_ptr<KilobotExperiment> experiment(create());
  if (experiment->serviceInterval != 20) fail("the service interval is not that of the experiment file");
  std::printf("createExpt: loaded, service interval %d ms\n", experiment->serviceInterval);
  const std::unique_ptr<QWidget> gui(experiment->createGUI());
  const auto* const label = qobject_cast<QLabel*>(gui.get());
  if (label == nullptr) fail("the panel is no QLabel");

  Station station(experiment.get());
  station.start();
  int status = 0;
  bool ended = false;
  // The panel tells the present state: after the end of the run it no longer says that it joined.
  QString joined;
  for (int round = 0; round < 2 * kRounds && !ended; ++round) {
    app.processEvents();
    if (label->text().contains("joined a run")) joined = label->text();
    std::this_thread::sleep_for(kPause);
    ended = waitpid(run, &status, WNOHANG) == run;
  }
  station.stop();
  if (!ended || status != 0) fail("the run did not see what it should");
  check_orders(station);
  if (joined.isEmpty()) fail("the panel did not say that it joined a run; it says: " + label->text());
  std::printf("panel: %s\n", qPrintable(joined));
  return 0;
}

#include "plugin_host.moc"
