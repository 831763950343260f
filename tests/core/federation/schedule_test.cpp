#include "core/federation/schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>
#include <string>
#include <vector>

namespace kilotwin {
namespace {

using Verdict = RunSchedule::Verdict;

Directive directive(std::uint64_t number, std::int64_t tick, DirectiveKind kind, std::uint32_t steps = 0) {
  Directive result;
  result.sequence_number = number;
  result.tick = Tick{tick};
  result.kind = kind;
  result.steps = steps;
  return result;
}

TEST(RunSchedule, RunsToItsEnd) {
  RunSchedule schedule(Tick{0}, Tick{3}, 0);
  for (int t = 0; t < 3; ++t) EXPECT_EQ(schedule.verdict(Tick{t}), Verdict::kStep);
  EXPECT_EQ(schedule.verdict(Tick{3}), Verdict::kFinished);
  EXPECT_FALSE(schedule.stopped_early());
}

TEST(RunSchedule, WaitsForADirectiveThatWasMentioned) {
  RunSchedule schedule(Tick{0}, Tick{100}, 0);
  schedule.mention(2);
  EXPECT_EQ(schedule.verdict(Tick{1}), Verdict::kAwaitDirective);
  schedule.add(directive(1, 9, DirectiveKind::kContinue));  // out of order: 0 is still missing
  EXPECT_EQ(schedule.known(), 0u);
  EXPECT_EQ(schedule.verdict(Tick{1}), Verdict::kAwaitDirective);
  schedule.add(directive(0, 5, DirectiveKind::kPause));
  EXPECT_EQ(schedule.known(), 2u);
  EXPECT_EQ(schedule.verdict(Tick{1}), Verdict::kStep);
}

TEST(RunSchedule, PausesStepsAndContinues) {
  RunSchedule schedule(Tick{0}, Tick{100}, 0);
  schedule.add(directive(0, 2, DirectiveKind::kPause));
  EXPECT_EQ(schedule.verdict(Tick{1}), Verdict::kStep);
  EXPECT_EQ(schedule.verdict(Tick{2}), Verdict::kPaused);
  schedule.add(directive(1, 2, DirectiveKind::kStep, 3));
  for (int t = 2; t < 5; ++t) EXPECT_EQ(schedule.verdict(Tick{t}), Verdict::kStep);
  EXPECT_EQ(schedule.verdict(Tick{5}), Verdict::kPaused);
  schedule.add(directive(2, 5, DirectiveKind::kContinue));
  EXPECT_EQ(schedule.verdict(Tick{5}), Verdict::kStep);
  EXPECT_EQ(schedule.verdict(Tick{6}), Verdict::kStep);
}

TEST(RunSchedule, StopsWhileItRunsAndWhileItPauses) {
  RunSchedule running(Tick{0}, Tick{100}, 0);
  running.add(directive(0, 7, DirectiveKind::kStop));
  EXPECT_EQ(running.verdict(Tick{6}), Verdict::kStep);
  EXPECT_EQ(running.verdict(Tick{7}), Verdict::kFinished);
  EXPECT_TRUE(running.stopped_early());
  EXPECT_EQ(running.last(), Tick{7});

  RunSchedule paused(Tick{0}, Tick{100}, 0);
  paused.add(directive(0, 7, DirectiveKind::kPause));
  EXPECT_EQ(paused.verdict(Tick{7}), Verdict::kPaused);
  paused.add(directive(1, 7, DirectiveKind::kStop));
  EXPECT_EQ(paused.verdict(Tick{7}), Verdict::kFinished);
}

TEST(RunSchedule, ASecondStopChangesNothing) {
  RunSchedule schedule(Tick{0}, Tick{100}, 0);
  schedule.add(directive(0, 7, DirectiveKind::kStop));
  schedule.add(directive(1, 7, DirectiveKind::kStop));
  EXPECT_EQ(schedule.verdict(Tick{7}), Verdict::kFinished);
  EXPECT_TRUE(schedule.stopped_early());
  EXPECT_EQ(schedule.last(), Tick{7});
}

TEST(RunSchedule, AStopBeyondTheEndChangesNothing) {
  RunSchedule schedule(Tick{0}, Tick{5}, 0);
  schedule.add(directive(0, 9, DirectiveKind::kStop));
  EXPECT_EQ(schedule.verdict(Tick{5}), Verdict::kFinished);
  EXPECT_FALSE(schedule.stopped_early());
}

TEST(RunSchedule, GivesInputsOnlyToTheirTick) {
  RunSchedule schedule(Tick{0}, Tick{100}, 0);
  Directive input = directive(0, 4, DirectiveKind::kOverheadInput);
  input.packet.message[0] = 42;
  schedule.add(input);
  EXPECT_EQ(schedule.verdict(Tick{3}), Verdict::kStep);
  EXPECT_TRUE(schedule.overhead_inputs().empty());
  EXPECT_EQ(schedule.verdict(Tick{4}), Verdict::kStep);
  EXPECT_EQ(schedule.verdict(Tick{4}), Verdict::kStep);  // asking twice gives it once
  ASSERT_EQ(schedule.overhead_inputs().size(), 1u);
  EXPECT_EQ(schedule.overhead_inputs()[0].message[0], 42);
  EXPECT_EQ(schedule.verdict(Tick{5}), Verdict::kStep);
  EXPECT_TRUE(schedule.overhead_inputs().empty());
}

TEST(RunSchedule, SavesPeriodicallyAndByDirective) {
  RunSchedule schedule(Tick{20}, Tick{100}, 10);
  schedule.add(directive(0, 33, DirectiveKind::kCheckpoint));
  std::vector<std::int64_t> saved;
  for (std::int64_t t = 20; t <= 50; ++t) {
    schedule.verdict(Tick{t});
    if (schedule.checkpoint_at(Tick{t})) saved.push_back(t);
  }
  EXPECT_EQ(saved, (std::vector<std::int64_t>{30, 33, 40, 50}));
}

TEST(Ingress, StampsAheadAndInOrder) {
  Ingress ingress;
  const Directive a = ingress.stamp(Tick{10}, directive(0, 0, DirectiveKind::kOverheadInput));
  const Directive b = ingress.stamp(Tick{11}, directive(0, 0, DirectiveKind::kOverheadInput));
  EXPECT_EQ(a.tick, Tick{10 + kAnnounceAhead});
  EXPECT_EQ(b.tick, Tick{11 + kAnnounceAhead});
  EXPECT_EQ(a.sequence_number, 0u);
  EXPECT_EQ(b.sequence_number, 1u);
}

TEST(Ingress, StampsForTheTickAtWhichTheRunPauses) {
  Ingress ingress;
  const Directive pause = ingress.stamp(Tick{10}, directive(0, 0, DirectiveKind::kPause));
  const Directive step = ingress.stamp(Tick{12}, directive(0, 0, DirectiveKind::kStep, 2));
  EXPECT_EQ(step.tick, pause.tick);
  const Directive go = ingress.stamp(step.tick, directive(0, 0, DirectiveKind::kContinue));
  EXPECT_EQ(go.tick, step.tick + 2);
}

/// A model of the federation: federates in the order of the path that a mention takes, each with its own schedule; frames
/// and directives travel with random delays. For any delays, all must do the same at every tick.
class Federation {
 public:
  explicit Federation(unsigned seed, std::int64_t last) : random_(seed), last_(last) {
    for (int i = 0; i < 4; ++i) federates_.push_back({RunSchedule(Tick{0}, Tick{last}, 0), Tick{0}, {}, {}, {}});
  }

  // station 0 -> radio 1 -> host 2 -> physics 3, and back: physics -> radio and station, host -> radio and station and
  // physics -> host is not needed. Each needs frame t of those it hears to step from t.
  static std::vector<int> sources(int federate) {
    switch (federate) {
      case 0: return {2, 3};
      case 1: return {0, 2, 3};
      case 2: return {1};
      default: return {2};
    }
  }

  void run() {
    for (int guard = 0; guard < 2'000'000; ++guard) {
      const int who = static_cast<int>(random_() % 4);
      if (who == 0 && random_() % 16 == 0) ask();
      deliver(who);
      advance(who);
      if (std::all_of(federates_.begin(), federates_.end(), [](const auto& f) { return f.done; })) return;
    }
    FAIL() << "the federation came to a halt";
  }

  [[nodiscard]] std::vector<std::string> histories() const {
    std::vector<std::string> result;
    for (const auto& federate : federates_) result.push_back(federate.history);
    return result;
  }

 private:
  struct Frame {
    int from;
    Tick tick;
    std::uint32_t mentions;
  };
  struct Member {
    RunSchedule schedule;
    Tick now;
    std::deque<Frame> frames;          // on their way
    std::deque<Directive> directives;  // on their way
    std::string history;
    Tick heard[4] = {Tick{-1}, Tick{-1}, Tick{-1}, Tick{-1}};
    bool published = false, done = false;
  };

  void ask() {
    if (federates_[0].done) return;
    static constexpr DirectiveKind kinds[] = {DirectiveKind::kPause,    DirectiveKind::kContinue,
                                              DirectiveKind::kStep,     DirectiveKind::kOverheadInput,
                                              DirectiveKind::kContinue, DirectiveKind::kContinue};
    Directive wanted = directive(0, 0, kinds[random_() % 6], 1 + static_cast<std::uint32_t>(random_() % 7));
    const Directive stamped = ingress_.stamp(federates_[0].now, wanted);
    federates_[0].schedule.add(stamped);
    for (int i = 1; i < 4; ++i) federates_[static_cast<std::size_t>(i)].directives.push_back(stamped);
  }

  void deliver(int who) {
    Member& member = federates_[static_cast<std::size_t>(who)];
    while (!member.frames.empty() && random_() % 3 != 0) {
      const Frame frame = member.frames.front();
      member.frames.pop_front();
      member.heard[frame.from] = frame.tick;
      member.schedule.mention(frame.mentions);
    }
    if (!member.directives.empty() && random_() % 8 == 0) {
      member.schedule.add(member.directives.front());
      member.directives.pop_front();
    }
  }

  void advance(int who) {
    Member& member = federates_[static_cast<std::size_t>(who)];
    if (member.done) return;
    if (!member.published) {
      member.published = true;
      for (int to = 0; to < 4; ++to) {
        const std::vector<int> hears = sources(to);
        if (std::find(hears.begin(), hears.end(), who) != hears.end()) {
          federates_[static_cast<std::size_t>(to)].frames.push_back({who, member.now, member.schedule.known()});
        }
      }
    }
    for (const int source : sources(who)) {
      if (member.heard[source] < member.now) return;
    }
    switch (member.schedule.verdict(member.now)) {
      case Verdict::kAwaitDirective: return;
      case Verdict::kPaused: return;
      case Verdict::kFinished: member.done = true; return;
      case Verdict::kStep: break;
    }
    if (!member.schedule.overhead_inputs().empty()) {
      member.history += std::to_string(member.schedule.overhead_inputs().size()) + " inputs at " +
                        std::to_string(member.now.count()) + "; ";
    }
    ++member.now;
    member.published = false;
  }

  std::mt19937 random_;
  std::int64_t last_;
  Ingress ingress_;
  std::vector<Member> federates_;
};

TEST(Ingress, ContinuesAfterEarlierDirectives) {
  const std::vector<Directive> stamped{directive(0, 7, DirectiveKind::kOverheadInput),
                                       directive(1, 90, DirectiveKind::kOverheadInput)};
  Ingress ingress(stamped);
  const Directive next = ingress.stamp(Tick{12}, directive(0, 0, DirectiveKind::kOverheadInput));
  EXPECT_EQ(next.sequence_number, 2u);
  EXPECT_EQ(next.tick, Tick{90}) << "no later input takes effect before an earlier one";
  // A schedule that starts between them applies what lies ahead.
  RunSchedule schedule(Tick{5}, Tick{200}, 0);
  for (const Directive& one : stamped) schedule.add(one);
  EXPECT_EQ(schedule.known(), 2u);
  for (int t = 5; t < 100; ++t) {
    ASSERT_EQ(schedule.verdict(Tick{t}), Verdict::kStep);
    EXPECT_EQ(schedule.overhead_inputs().size(), t == 7 || t == 90 ? 1u : 0u) << t;
  }
}

TEST(RunSchedule, AllFederatesActAlikeForAnyDelays) {
  std::size_t inputs_seen = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Federation federation(seed, 400);
    federation.run();
    // Federates may pause at different times, but must give each input to the same tick.
    const std::vector<std::string> histories = federation.histories();
    for (const std::string& other : histories) ASSERT_EQ(other, histories[0]) << "seed " << seed;
    inputs_seen += histories[0].size();
  }
  EXPECT_GT(inputs_seen, 0u);
}

}  // namespace
}  // namespace kilotwin
