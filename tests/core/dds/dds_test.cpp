#include "core/dds/dds.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "core/base/error.hpp"
#include "core/federation/topics.hpp"

namespace kilotwin::dds {
namespace {

/// Values that a receive thread collects and a test waits for.
template <class T> class Mailbox {
 public:
  void put(T value) {
    const std::lock_guard lock(mutex_);
    values_.push_back(std::move(value));
    arrived_.notify_all();
  }
  /// False where `count` values have not come within 20 s: a bound against hanging, not a measurement.
  bool wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, std::chrono::seconds(20), [&] { return values_.size() >= count; });
  }
  std::vector<T> values() {
    const std::lock_guard lock(mutex_);
    return values_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<T> values_;
};

PublicRunStatus status_of(std::uint64_t run) {
  PublicRunStatus status{};
  status.run = run;
  return status;
}

TEST(Dds, CarriesSamplesToALateReader) {
  const DomainClaim claim = DomainClaim::any();
  const Participant participant({claim.domain(), {}});
  Writer<PublicRunStatus> writer(participant, topics::run_status());
  writer.write(status_of(7));
  Mailbox<std::uint64_t> box;
  const Reader<PublicRunStatus> reader(participant, topics::run_status(),
                                       [&](const PublicRunStatus& sample, SampleState state) {
                                         if (state.valid) box.put(sample.run);
                                       });
  ASSERT_TRUE(box.wait_for(1));
  EXPECT_EQ(box.values()[0], 7u);
}

TEST(Dds, RoutesByPartition) {
  const DomainClaim claim = DomainClaim::any();
  const Participant participant({claim.domain(), {}});
  Mailbox<std::uint64_t> first, second;
  const auto collect = [](Mailbox<std::uint64_t>& box) {
    return [&box](const WireBodyFrame& sample, SampleState state) {
      if (state.valid) box.put(sample.run);
    };
  };
  const Reader<WireBodyFrame> to_first(participant, topics::ghosts(1), collect(first));
  const Reader<WireBodyFrame> to_second(participant, topics::ghosts(2), collect(second));
  Writer<WireBodyFrame> writer_first(participant, topics::ghosts(1));
  Writer<WireBodyFrame> writer_second(participant, topics::ghosts(2));
  WireBodyFrame frame{};
  frame.run = 1;
  writer_first.write(frame);
  frame.run = 2;
  writer_second.write(frame);
  ASSERT_TRUE(first.wait_for(1));
  ASSERT_TRUE(second.wait_for(1));
  EXPECT_EQ(first.values(), std::vector<std::uint64_t>{1});
  EXPECT_EQ(second.values(), std::vector<std::uint64_t>{2});
}

TEST(Dds, TellsThatAKilledProcessIsGone) {
  const DomainClaim claim = DomainClaim::any();
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const Participant participant({claim.domain(), {}});
    Writer<WireMember> writer(participant, topics::members());
    WireMember member{};
    member.publisher = 5;
    writer.write(member);
    pause();
    _exit(0);
  }
  const Participant participant({claim.domain(), {}});
  Mailbox<bool> alive;
  const Reader<WireMember> reader(participant, topics::members(), [&](const WireMember& sample, SampleState state) {
    if (sample.publisher == 5) alive.put(state.alive);
  });
  const bool came = alive.wait_for(1);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ASSERT_TRUE(came);
  ASSERT_TRUE(alive.wait_for(2));
  EXPECT_TRUE(alive.values()[0]);
  EXPECT_FALSE(alive.values()[1]);
}

TEST(DomainClaim, IsExclusiveWhileItLasts) {
  std::uint32_t domain = 0;
  {
    const DomainClaim claim = DomainClaim::any();
    domain = claim.domain();
    EXPECT_THROW(DomainClaim::exactly(domain), UserError);
    EXPECT_NE(DomainClaim::any().domain(), domain);
  }
  EXPECT_EQ(DomainClaim::exactly(domain).domain(), domain);
  EXPECT_THROW(DomainClaim::exactly(kLastDomain + 1), UserError);
}

}  // namespace
}  // namespace kilotwin::dds
