// Real sessions over DDS, in threads of this process, with minimal federates.
#include "core/federation/session.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <functional>
#include <future>
#include <limits>
#include <map>
#include <thread>

#include "core/base/error.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/likely_cause.hpp"
#include "tests/support/scenes.hpp"

namespace kilotwin {
namespace {

/// A frame of the station whose decoding the test watches.
struct WatchedFrame {
  Tick tick;
};
std::function<void(Tick)> on_decoding;  // on a receive thread
bool from_wire(const WireOverheadFrame& wire, WatchedFrame& frame) {
  frame.tick = Tick{wire.tick};
  if (on_decoding) on_decoding(frame.tick);
  return true;
}
const char* defect(const WatchedFrame&, const RunPlan&, FederateId, FederateId) { return nullptr; }

}  // namespace
template <> struct WireOf<WatchedFrame> { using Type = WireOverheadFrame; };
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kLast = 60;

/// Hooks by which tests act on a federate, called on the federate's thread.
struct Hooks {
  std::function<void(Session&)> on_publish, on_idle;
  std::function<double(Tick)> ahead_s;
  std::function<void(BodyFrame&)> spoil_bodies;
  std::function<void(ActuationFrame&)> spoil_actuation;
  std::function<void(RadioFrame&)> spoil_radio;
  std::function<void(OverheadFrame&)> spoil_overhead;
  bool watches_overhead = false;
};

/// A federate of each kind: one partition, radio, station, one host.
class Tiny : public Federate {
 public:
  Tiny(Session& session, const Hooks& hooks) : session_(session), hooks_(hooks), plan_(session.plan()) {
    const FederateId self = session.self();
    const std::vector<FederateId> physics = plan_.all_physics(), hosts = plan_.all_behaviours();
    if (self == physics[0]) {
      actuation_in_ = std::make_unique<Input<ActuationFrame>>(session, topics::actuation(), hosts);
      bodies_ = std::make_unique<Output<BodyFrame>>(session, topics::bodies());
    } else if (self == plan_.radio()) {
      bodies_in_ = std::make_unique<Input<BodyFrame>>(session, topics::bodies(), physics);
      actuation_in_ = std::make_unique<Input<ActuationFrame>>(session, topics::actuation(), hosts);
      overhead_in_ =
          std::make_unique<Input<OverheadFrame>>(session, topics::overhead(), std::vector{plan_.station()});
      radio_ = std::make_unique<Output<RadioFrame>>(session, topics::radio(0));
      if (hooks.watches_overhead)
        watched_in_ =
            std::make_unique<Input<WatchedFrame>>(session, topics::overhead(), std::vector{plan_.station()});
    } else if (self == plan_.station()) {
      bodies_in_ = std::make_unique<Input<BodyFrame>>(session, topics::bodies(), physics);
      actuation_in_ = std::make_unique<Input<ActuationFrame>>(session, topics::actuation(), hosts);
      overhead_ = std::make_unique<Output<OverheadFrame>>(session, topics::overhead());
    } else {
      radio_in_ = std::make_unique<Input<RadioFrame>>(session, topics::radio(0), std::vector{plan_.radio()});
      actuation_ = std::make_unique<Output<ActuationFrame>>(session, topics::actuation());
    }
  }

  void publish(Tick now) override {
    if (hooks_.on_publish) hooks_.on_publish(session_);
    const std::uint32_t robots = plan_.robots();
    send(bodies_, now, hooks_.spoil_bodies, [&](BodyFrame& frame) {
      frame.clear();
      for (std::uint32_t i = 0; i < robots; ++i) frame.add(i, 50.0 * i, 0, 0);
    });
    send(actuation_, now, hooks_.spoil_actuation, [&](ActuationFrame& frame) {
      frame.first_robot = 0;
      frame.motor_left.assign(robots, 0);
      frame.motor_right = frame.led = frame.life_cycle = frame.motor_left;
      frame.tx_period.assign(robots, 3906);
      frame.spin_up.assign(robots, 0);
      frame.offer_robot = {0, 2};
      frame.offer_message.resize(2);
    });
    send(radio_, now, hooks_.spoil_radio, [&](RadioFrame& frame) {
      frame.first_robot = 0;
      frame.kilo_ticks.assign(robots, 1);
      frame.ask = {1};
      frame.sent = {0, 1};
      frame.reception_robot = {0, 0, 2};
      frame.reception_message = {1, 0, 1};
      frame.reception_high_gain = frame.reception_low_gain = {1, 2, 3};
      frame.messages.resize(2);
    });
    send(overhead_, now, hooks_.spoil_overhead, [](OverheadFrame& frame) { frame.packets.resize(1); });
  }
  double ahead_s(Tick now) override { return hooks_.ahead_s ? hooks_.ahead_s(now) : 0; }
  void inputs_complete(Tick now, bool is_last) override {
    if (is_last) last = now;
  }
  void step(Tick from) override {
    if (bodies_in_) {
      EXPECT_EQ(bodies_in_->at(from)[0]->tick, from);
    }
    if (radio_in_) {
      EXPECT_EQ(radio_in_->at(from)[0]->reception_robot.size(), 3u);
    }
    for (const OverheadPacket& packet : session_.schedule().overhead_inputs()) {
      inputs += std::to_string(packet.message[0]) + " at " + std::to_string(from.count()) + "; ";
    }
  }
  std::uint64_t hash_part() const override { return 1; }
  void save(Tick now) override { saved.push_back(now.count()); }
  void idle() override {
    if (hooks_.on_idle) hooks_.on_idle(session_);
  }

  std::string inputs;
  std::vector<std::int64_t> saved;
  Tick last{-1};

 private:
  template <class Frame, class Spoil, class Fill>
  void send(const std::unique_ptr<Output<Frame>>& output, Tick now, const Spoil& spoil, Fill fill) {
    if (!output) return;
    fill(output->frame);
    output->frame.tick = now;
    if (spoil && now == Tick{10}) spoil(output->frame);
    output->write();
  }

  Session& session_;
  const Hooks& hooks_;
  const RunPlan& plan_;
  std::unique_ptr<Input<BodyFrame>> bodies_in_;
  std::unique_ptr<Input<ActuationFrame>> actuation_in_;
  std::unique_ptr<Input<RadioFrame>> radio_in_;
  std::unique_ptr<Input<OverheadFrame>> overhead_in_;
  std::unique_ptr<Input<WatchedFrame>> watched_in_;
  std::unique_ptr<Output<BodyFrame>> bodies_;
  std::unique_ptr<Output<ActuationFrame>> actuation_;
  std::unique_ptr<Output<RadioFrame>> radio_;
  std::unique_ptr<Output<OverheadFrame>> overhead_;
};

/// Thrown by a hook: the federate vanishes without a FAILED sample.
struct Vanishes {};

class Sessions : public ::testing::Test {
 protected:
  struct Outcome {
    std::string failure, inputs;
    std::vector<std::int64_t> saved;
    Tick last{-1};
    double wall_s = 0;
  };

  ~Sessions() override { join(); }

  void start(FederateId id) {
    threads_.emplace_back([this, id] {
      Outcome& outcome = outcomes_[id.value()];
      Session session(plan_, id, {claim_.domain(), {}}, Tick{0}, {}, give_up_after_s_);
      Tiny federate(session, hooks_[id.value()]);
      try {
        session.run(federate);
      } catch (const std::exception& error) {
        outcome.failure = error.what();
      } catch (const Vanishes&) {
        outcome.failure = "vanished";
      }
      outcome.inputs = federate.inputs;
      outcome.saved = federate.saved;
      outcome.last = federate.last;
      outcome.wall_s = session.wall_s();
    });
  }
  void start_all() {
    for (std::uint32_t i = 0; i < plan_.federates(); ++i) start(FederateId{i});
  }
  /// Starts the host once the station, which runs with all others, has said that it waits for the host.
  void start_host_when_awaited() {
    of(plan_.station()).on_idle = [&](Session& session) {
      if (session.waiting_for().find("behaviours 1/1 to arrive") != std::string::npos) awaited_ = true;
    };
    for (std::uint32_t i = 0; i < host_.value(); ++i) start(FederateId{i});
    for (int i = 0; i < 3000 && !awaited_; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_TRUE(awaited_);
    start(host_);
  }
  void join() {
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }
  void run_all() {
    start_all();
    join();
  }
  Hooks& of(FederateId id) { return hooks_[id.value()]; }
  void expect_all_end_at(std::int64_t tick) {
    for (const Outcome& outcome : outcomes_) {
      EXPECT_EQ(outcome.failure, "");
      EXPECT_EQ(outcome.last, Tick{tick});
    }
  }
  /// Checks that every other federate reports a failure that names `culprit`.
  void expect_all_name(FederateId culprit, const std::string& text) {
    for (std::uint32_t i = 0; i < outcomes_.size(); ++i) {
      if (i == culprit.value()) continue;
      EXPECT_NE(outcomes_[i].failure.find(text), std::string::npos)
          << plan_.name(FederateId{i}) << ": " << outcomes_[i].failure;
    }
  }
  void expect_malformed(const std::string& why) {
    bool named = false;
    for (const Outcome& outcome : outcomes_) {
      EXPECT_NE(outcome.failure, "");
      named = named || outcome.failure.find("malformed: " + why) != std::string::npos;
    }
    EXPECT_TRUE(named) << outcomes_[0].failure << '\n'
                       << outcomes_[1].failure << '\n'
                       << outcomes_[2].failure << '\n'
                       << outcomes_[3].failure;
  }
  WireMember member(FederateId id, kilotwin_wire_MemberPhase phase) const {
    WireMember sample{};
    sample.publisher = id.value();
    sample.run = plan_.run();
    sample.plan_hash = plan_.hash;
    sample.phase = phase;
    sample.process = 1;
    std::string_view(plan_.build).copy(sample.build, sizeof sample.build - 1);
    return sample;
  }

  const RunPlan plan_ =
      testing::make_plan("duration_s: " + std::to_string(kLast * 0.032768 - 1e-3) + " robots { count: 3 }",
                         {{0, 0, 0}, {50, 0, 0}, {100, 0, 0}});
  const dds::DomainClaim claim_ = dds::DomainClaim::any();
  const FederateId physics_ = plan_.physics(PartitionId{0}), host_ = plan_.behaviours(HostId{0});
  double give_up_after_s_ = 0;
  std::array<Hooks, 4> hooks_;
  std::array<Outcome, 4> outcomes_;
  std::atomic<bool> awaited_{false};  ///< the station has said that it waits for the host
  std::vector<std::thread> threads_;
};

TEST_F(Sessions, RunToTheEndTogether) {
  run_all();
  expect_all_end_at(kLast);
}

/// Stands in for the station's ingress.
class Director {
 public:
  explicit Director(Session& session) : session_(session) {}
  void announce(DirectiveKind kind, std::uint32_t steps = 0, std::uint8_t octet = 0) {
    Directive directive;
    directive.kind = kind;
    directive.steps = steps;
    directive.packet.message[0] = octet;
    session_.announce(ingress_.stamp(session_.now(), directive));
  }

 private:
  Session& session_;
  Ingress ingress_;
};

TEST_F(Sessions, PauseStepSaveAndStopAlike) {
  std::optional<Director> director;
  int turn = 0;
  const auto act = [&](Session& session) {
    if (!director) director.emplace(session);
    if (turn == 0 && session.now() == Tick{8}) {
      ++turn;
      director->announce(DirectiveKind::kPause);  // at 12
      director->announce(DirectiveKind::kOverheadInput, 0, 7);
    } else if (turn == 1 && session.paused()) {
      ++turn;
      director->announce(DirectiveKind::kCheckpoint);
      director->announce(DirectiveKind::kOverheadInput, 0, 8);
    } else if (turn == 2 && session.paused()) {
      ++turn;
      director->announce(DirectiveKind::kStep, 3);
    } else if (turn == 3 && session.paused() && session.now() == Tick{15}) {
      ++turn;
      // All at once, while the run is paused: it saves at this tick and continues only to the next pause.
      director->announce(DirectiveKind::kCheckpoint);
      director->announce(DirectiveKind::kContinue);
      director->announce(DirectiveKind::kPause);
      director->announce(DirectiveKind::kStop);
      director->announce(DirectiveKind::kStop);
    }
  };
  of(plan_.station()).on_publish = of(plan_.station()).on_idle = act;
  run_all();
  const Tick last = outcomes_[0].last;
  EXPECT_GE(last, Tick{15});
  expect_all_end_at(last.count());
  for (const Outcome& outcome : outcomes_) {
    EXPECT_EQ(outcome.inputs, "7 at 12; 8 at 12; ");
    EXPECT_EQ(outcome.saved, (std::vector<std::int64_t>{12, 15}));
  }
}

TEST_F(Sessions, TakeDirectivesOfTheLastTicks) {
  std::optional<Director> director;
  of(plan_.station()).on_publish = [&](Session& session) {
    if (!director) director.emplace(session);
    if (session.now() >= Tick{kLast - 6}) director->announce(DirectiveKind::kOverheadInput, 0, 1);
  };
  run_all();
  expect_all_end_at(kLast);
  for (const Outcome& outcome : outcomes_) EXPECT_EQ(outcome.inputs, outcomes_[0].inputs);
}

TEST_F(Sessions, TakeDirectivesThatAFederateWasTooLateToHear) {
  std::optional<Director> director;
  of(plan_.station()).on_publish = [&](Session& session) {
    if (session.now() != Tick{0}) return;
    director.emplace(session);
    for (std::uint8_t octet = 1; octet <= 3; ++octet) director->announce(DirectiveKind::kOverheadInput, 0, octet);
  };
  start_host_when_awaited();
  join();
  expect_all_end_at(kLast);
  for (const Outcome& outcome : outcomes_) EXPECT_EQ(outcome.inputs, "1 at 4; 2 at 4; 3 at 4; ");
}

TEST_F(Sessions, KeepNoMemoryOfDirectives) {
  constexpr int kPerTick = 200, kFirst = 5, kTicks = 50;
  constexpr std::size_t kMost_bytes = 2 << 20;  // directives on their way included; a kept instance has some 800
  std::optional<Director> director;
  std::size_t before = 0, after = 0;
  of(plan_.station()).on_publish = [&](Session& session) {
    const std::int64_t tick = session.now().count();
    if (tick == kFirst) {
      director.emplace(session);
      before = mallinfo2().uordblks;
    }
    if (tick >= kFirst && tick < kFirst + kTicks)
      for (int i = 0; i < kPerTick; ++i) director->announce(DirectiveKind::kOverheadInput, 0, 1);
    if (tick == kLast) after = mallinfo2().uordblks;
  };
  run_all();
  expect_all_end_at(kLast);
  const std::string one = "1 at 9; ";
  EXPECT_GE(outcomes_[0].inputs.size(), one.size() * kPerTick * kTicks) << "all of them have come";
  EXPECT_LT(after, before + kMost_bytes);
}

TEST_F(Sessions, DoNotCountPauses) {
  std::optional<Director> director;
  std::chrono::steady_clock::time_point paused_at{};
  double while_paused_s = 0;
  of(plan_.station()).on_publish = of(plan_.station()).on_idle = [&](Session& session) {
    if (!director) director.emplace(session);
    if (session.now() == Tick{0} && session.started() && paused_at == std::chrono::steady_clock::time_point{}) {
      paused_at = std::chrono::steady_clock::now();
      director->announce(DirectiveKind::kPause);
    } else if (session.paused() && std::chrono::steady_clock::now() > paused_at + 500ms) {
      while_paused_s = session.wall_s();
      director->announce(DirectiveKind::kContinue);
      paused_at += 1h;
    }
  };
  run_all();
  expect_all_end_at(kLast);
  const double from_pause_s = 0.4;
  EXPECT_GT(while_paused_s, 0);
  EXPECT_LT(while_paused_s, from_pause_s) << "also not while it lasts";
}

TEST_F(Sessions, NameTheFederateThatFails) {
  of(host_).on_publish = [](Session& session) {
    if (session.now() == Tick{5}) throw RunError("the disk is full");
  };
  run_all();
  EXPECT_EQ(outcomes_[host_.value()].failure, "the disk is full");
  expect_all_name(host_, "behaviours 1/1");
  EXPECT_NE(outcomes_[plan_.radio().value()].failure.find("the disk is full"), std::string::npos)
      << outcomes_[1].failure;
}

TEST_F(Sessions, NameTheFederateThatVanishes) {
  of(host_).on_publish = [](Session& session) {
    if (session.now() == Tick{5}) throw Vanishes{};
  };
  run_all();
  expect_all_name(host_, "behaviours 1/1 was lost");
}

TEST_F(Sessions, DoNotWaitForAFederateThatLeftTooEarly) {
  // It writes FINISHED before it has sent all frames.
  const dds::Participant participant({claim_.domain(), {}});
  of(host_).on_publish = [&](Session& session) {
    if (session.now() != Tick{5}) return;
    dds::Writer<WireMember> writer(participant, topics::members());
    writer.write(member(host_, kilotwin_wire_FINISHED));
    writer.flush(5);
    throw Vanishes{};
  };
  run_all();
  expect_all_name(host_, "behaviours 1/1");
  EXPECT_NE(outcomes_[plan_.radio().value()].failure.find("left without its frame of tick 5"), std::string::npos)
      << outcomes_[1].failure;
}

TEST_F(Sessions, DecodeFramesWithoutTheirMutex) {
  std::atomic<Session*> radio{nullptr};
  std::atomic<int> free{0}, held{0};
  of(plan_.radio()).watches_overhead = true;
  of(plan_.radio()).on_publish = [&](Session& session) { radio = &session; };
  // By a thread of its own: one that held the mutex may not try it.
  on_decoding = [&](Tick tick) {
    if (tick < Tick{10} || radio == nullptr || held > 0) return;
    const bool is_free = std::async(std::launch::async, [&radio] {
                           const auto until = std::chrono::steady_clock::now() + 5s;
                           do {
                             if (const std::unique_lock lock(radio.load()->mutex(), std::try_to_lock); lock)
                               return true;
                             std::this_thread::sleep_for(1ms);
                           } while (std::chrono::steady_clock::now() < until);
                           return false;
                         }).get();
    ++(is_free ? free : held);
  };
  run_all();
  on_decoding = nullptr;
  expect_all_end_at(kLast);
  EXPECT_GT(free, 0);
  EXPECT_EQ(held, 0);
}

TEST_F(Sessions, PrintTheFederatesThatTheyWaitFor) {
  start_host_when_awaited();
  join();
  expect_all_end_at(kLast);
}

TEST_F(Sessions, GiveUpAWaitWithoutProgress) {
  give_up_after_s_ = 0.5;
  start(plan_.station());
  join();
  const std::string& failure = outcomes_[plan_.station().value()].failure;
  EXPECT_NE(failure.find("station gave up after it had waited"), std::string::npos) << failure;
  EXPECT_NE(failure.find("for physics 0,0; radio; behaviours 1/1 to arrive"), std::string::npos) << failure;
  EXPECT_NE(failure.find(fmt::format("1 of 4 services were heard on DDS domain {}", claim_.domain())),
            std::string::npos)
      << failure;
}

TEST_F(Sessions, CountWaitingForThePaceAsWaiting) {
  constexpr std::uint64_t kHeld_ns = 1'000'000'000;
  std::optional<std::chrono::steady_clock::time_point> held_from;
  of(plan_.station()).ahead_s = [&](Tick now) {
    if (now != Tick{5}) return 0.0;
    const auto at = std::chrono::steady_clock::now();
    if (!held_from) held_from = at;
    return std::chrono::duration<double>(*held_from + std::chrono::nanoseconds(kHeld_ns) - at).count();
  };
  const dds::Participant participant({claim_.domain(), {}});
  std::atomic<std::uint64_t> step_ns{0}, wait_ns{0};
  const dds::Reader<WireMetrics> reader(participant, topics::metrics(),
                                        [&](const WireMetrics& metrics, dds::SampleState state) {
                                          if (!state.valid || metrics.publisher != plan_.station().value()) return;
                                          step_ns = metrics.step_ns;
                                          wait_ns = metrics.wait_ns;
                                        });
  run_all();
  expect_all_end_at(kLast);
  EXPECT_GE(wait_ns, kHeld_ns);
  EXPECT_LT(step_ns, kHeld_ns);
}

TEST_F(Sessions, RefuseAnotherBuild) {
  const dds::Participant participant({claim_.domain(), {}});
  dds::Writer<WireMember> writer(participant, topics::members());
  WireMember other = member(host_, kilotwin_wire_ARRIVING);
  std::string_view("1.0-other").copy(other.build, sizeof other.build - 1);
  writer.write(other);
  start(plan_.radio());
  join();
  const std::string& failure = outcomes_[plan_.radio().value()].failure;
  EXPECT_NE(failure.find("is of build 1.0-other, this service is of build " + plan_.build), std::string::npos)
      << failure;
}

TEST_F(Sessions, StartedTwiceDoNotDisturbTheFirst) {
  const dds::Participant participant({claim_.domain(), {}});
  dds::Writer<WireMember> first(participant, topics::members());
  first.write(member(host_, kilotwin_wire_STEPPING));
  start(host_);
  join();
  EXPECT_NE(outcomes_[host_.value()].failure.find("behaviours 1/1 of this run was started already"),
            std::string::npos)
      << outcomes_[host_.value()].failure;
}

TEST_F(Sessions, ContinueAfterASecondStart) {
  // The second process writes ARRIVING, and leaves when it hears the first one.
  const dds::Participant participant({claim_.domain(), {}});
  of(plan_.station()).on_publish = [&](Session& session) {
    if (session.now() != Tick{20}) return;
    dds::Writer<WireMember> writer(participant, topics::members());
    writer.write(member(host_, kilotwin_wire_ARRIVING));
    writer.flush(5);
  };
  run_all();
  expect_all_end_at(kLast);
}

TEST(LikelyCause, NamesTheAddressesThatAreSearched) {
  const std::string local = likely_cause({7, {}}, 1, 4);
  EXPECT_NE(local.find("1 of 4 services were heard on DDS domain 7"), std::string::npos) << local;
  EXPECT_NE(local.find("without --peer only services of this machine meet"), std::string::npos) << local;
  EXPECT_NE(local.find("UDP ports 9150 to 9399"), std::string::npos) << local;
  const std::string spread = likely_cause({7, {"10.0.0.1", "10.0.0.2"}}, 3, 4);
  EXPECT_NE(spread.find("looks for others at 10.0.0.1, 10.0.0.2"), std::string::npos) << spread;
  EXPECT_NE(likely_cause({7, {}}, 4, 4).find("frames do not come through"), std::string::npos);
}

// Frames that are refused before an engine uses them.
TEST_F(Sessions, RefuseARobotOutOfRange) {
  of(physics_).spoil_bodies = [](BodyFrame& frame) { frame.robot[2] = 1'000'000; };
  run_all();
  expect_malformed("its robots");
}
TEST_F(Sessions, RefuseAPoseThatIsNotFinite) {
  of(physics_).spoil_bodies = [](BodyFrame& frame) { frame.y_mm[1] = std::numeric_limits<double>::quiet_NaN(); };
  run_all();
  expect_malformed("a pose");
}
TEST_F(Sessions, RefuseArraysOfUnequalLength) {
  of(physics_).spoil_bodies = [](BodyFrame& frame) { frame.heading_rad.pop_back(); };
  run_all();
  expect_malformed("its arrays");
}
TEST_F(Sessions, RefuseAnotherShareOfRobots) {
  of(host_).spoil_actuation = [](ActuationFrame& frame) { frame.first_robot = 0xfffffffe; };
  run_all();
  expect_malformed("it is not of the host's share");
}
TEST_F(Sessions, RefuseAnOfferOfAnotherHostsRobot) {
  of(host_).spoil_actuation = [](ActuationFrame& frame) { frame.offer_robot[1] = 3; };
  run_all();
  expect_malformed("it offers");
}
TEST_F(Sessions, RefuseAReceptionWithoutMessage) {
  of(plan_.radio()).spoil_radio = [](RadioFrame& frame) { frame.reception_message[1] = 2; };
  run_all();
  expect_malformed("a reception");
}
TEST_F(Sessions, RefuseReceptionsOutOfOrder) {
  of(plan_.radio()).spoil_radio = [](RadioFrame& frame) { frame.reception_robot = {2, 0, 1}; };
  run_all();
  expect_malformed("its receptions");
}
TEST_F(Sessions, RefuseAnUnknownCommand) {
  of(plan_.station()).spoil_overhead = [](OverheadFrame& frame) {
    frame.packets[0].command = static_cast<OverheadCommand>(9);
  };
  run_all();
  expect_malformed("a packet's command");
}

/// A program that knows the run's id and writes arbitrary samples.
class Strangers : public Sessions {
 protected:
  template <class Wire> void interfere(const dds::Channel& channel, const Wire& sample) {
    of(plan_.station()).on_publish = [this, channel, sample](Session& session) {
      if (session.now() != Tick{20}) return;
      dds::Writer<Wire> writer(participant_, channel);
      writer.write(sample);
      writer.flush(5);
    };
    run_all();
  }
  const dds::Participant participant_{{claim_.domain(), {}}};
};

TEST_F(Strangers, AreRefusedAsPublishers) {
  WireBodyFrame frame{};
  frame.run = plan_.run();
  frame.publisher = 99;
  frame.tick = std::numeric_limits<std::int64_t>::max();
  interfere(topics::bodies(), frame);
  for (const Outcome& outcome : outcomes_)
    EXPECT_NE(outcome.failure.find("was not expected"), std::string::npos) << outcome.failure;
}

TEST_F(Strangers, OfAnotherRunAreNotHeard) {
  WireBodyFrame frame{};
  frame.run = plan_.run() + 1;
  frame.tick = 1'000'000;
  interfere(topics::bodies(), frame);
  expect_all_end_at(kLast);
}

TEST_F(Strangers, CannotAdmitARobotThatDoesNotExist) {
  WireDirective directive{};
  directive.run = plan_.run();
  directive.kind = kilotwin_wire_MEMBERSHIP;
  directive.tick = 30;
  directive.robot = 1'000'000'000;
  interfere(topics::directives(), directive);
  EXPECT_NE(outcomes_[0].failure.find("malformed: its robot"), std::string::npos) << outcomes_[0].failure;
}

TEST_F(Strangers, CannotPlaceARobotOutsideTheArena) {
  WireDirective directive{};
  directive.run = plan_.run();
  directive.kind = kilotwin_wire_RELOCATION;
  directive.tick = 30;
  directive.x_mm = 1e9;
  interfere(topics::directives(), directive);
  EXPECT_NE(outcomes_[0].failure.find("malformed: its place"), std::string::npos) << outcomes_[0].failure;
}

TEST_F(Strangers, CannotSendHalfAPacket) {
  WireDirective directive{};
  directive.run = plan_.run();
  directive.kind = kilotwin_wire_OVERHEAD_INPUT;
  interfere(topics::directives(), directive);
  EXPECT_NE(outcomes_[0].failure.find("malformed: its packet"), std::string::npos) << outcomes_[0].failure;
}

TEST_F(Strangers, OfASecondRunDoNotEndTheActiveRun) {
  for (const auto phase : {kilotwin_wire_ARRIVING, kilotwin_wire_STEPPING, kilotwin_wire_FAILED}) {
    WireMember other = member(host_, phase);
    other.run = plan_.run() + 1;
    interfere(topics::members(), other);
    expect_all_end_at(kLast);
  }
}

TEST_F(Strangers, OfAnActiveRunAreNamedByALaterRun) {
  WireMember other = member(host_, kilotwin_wire_STEPPING);
  other.run = plan_.run() + 1;
  dds::Writer<WireMember> writer(participant_, topics::members());
  writer.write(other);
  run_all();
  for (const Outcome& outcome : outcomes_)
    EXPECT_NE(outcome.failure.find("in use by another run"), std::string::npos) << outcome.failure;
}

TEST_F(Strangers, OfTwoRunsThatArriveTheLaterOneLeaves) {
  WireMember other = member(host_, kilotwin_wire_ARRIVING);
  other.run = plan_.run() + 1;
  other.arrived_us = std::numeric_limits<std::int64_t>::max();
  dds::Writer<WireMember> writer(participant_, topics::members());
  writer.write(other);
  run_all();
  expect_all_end_at(kLast);
  other.arrived_us = 0;
  writer.write(other);
  run_all();
  for (const Outcome& outcome : outcomes_)
    EXPECT_NE(outcome.failure.find("in use by another run"), std::string::npos) << outcome.failure;
}

}  // namespace
}  // namespace kilotwin
