#include "core/dds/dds.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
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

/// Values that a receive thread collects and for which a test waits.
template <class T> class Mailbox {
 public:
  void put(T value) {
    const std::lock_guard lock(mutex_);
    values_.push_back(std::move(value));
    arrived_.notify_all();
  }
  /// Returns false if fewer than `count` values arrive within 20 s. The limit prevents a hang; it is no measurement.
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

TEST(Dds, KeepsUnreadMetricsAndTheLastSample) {
  const DomainClaim claim = DomainClaim::any();
  const Participant participant({claim.domain(), {}});
  Writer<WireMetrics> writer(participant, topics::metrics());
  constexpr std::size_t kSamples = 1000;
  const auto write_all = [&] {
    for (std::size_t i = 0; i < kSamples; ++i) {
      WireMetrics metrics{};
      metrics.run = 1;
      metrics.first_tick = static_cast<std::int64_t>(i);
      writer.write(metrics);
    }
  };
  Mailbox<std::int64_t> early, late;
  const auto to = [](Mailbox<std::int64_t>& box) {
    return [&box](const WireMetrics& metrics, SampleState state) {
      if (state.valid) box.put(metrics.first_tick);
    };
  };
  const Reader<WireMetrics> reader(participant, topics::metrics(), to(early));
  write_all();
  ASSERT_TRUE(early.wait_for(kSamples));
  const Reader<WireMetrics> newcomer(participant, topics::metrics(), to(late));
  ASSERT_TRUE(late.wait_for(1));
  EXPECT_EQ(late.values(), std::vector<std::int64_t>{kSamples - 1});
}

TEST(Dds, ReportsAFullDomain) {
  const DomainClaim claim = DomainClaim::any();
  EXPECT_FALSE(domain_is_full(claim.domain()));
  std::vector<int> sockets;
  for (std::uint32_t index = 0; index < kMostParticipants; ++index) {
    sockets.push_back(socket(AF_INET, SOCK_DGRAM, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * claim.domain() + 10 + 2 * index));
    ASSERT_EQ(bind(sockets.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << index;
  }
  try {
    const Participant participant({claim.domain(), {}});
    ADD_FAILURE() << "an index of the next domain was taken";
  } catch (const RunError& error) {
    EXPECT_NE(std::string(error.what()).find("is full: 120 processes"), std::string::npos) << error.what();
  }
  for (const int fd : sockets) close(fd);
  const Participant participant({claim.domain(), {}});
}

TEST(Dds, DeliversSamplesToALateReader) {
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

TEST(Dds, ReportsTheEndOfAProcess) {
  const DomainClaim claim = DomainClaim::any();
  int stay[2];
  ASSERT_EQ(pipe(stay), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    close(stay[1]);
    {
      const Participant participant({claim.domain(), {}});
      Writer<WireMember> writer(participant, topics::members());
      WireMember member{};
      member.publisher = 5;
      writer.write(member);
      char octet = 0;
      while (::read(stay[0], &octet, 1) > 0) continue;
    }
    _exit(0);
  }
  close(stay[0]);
  const Participant participant({claim.domain(), {}});
  Mailbox<bool> alive;
  const Reader<WireMember> reader(participant, topics::members(), [&](const WireMember& sample, SampleState state) {
    if (sample.publisher == 5) alive.put(state.alive);
  });
  const bool came = alive.wait_for(1);
  close(stay[1]);
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
