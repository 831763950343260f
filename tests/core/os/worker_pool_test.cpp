// The worker pool: every task runs once, the caller gets exceptions, the destructor does not dead-lock.
#include "core/os/worker_pool.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

/// The calling thread's calls of sched_yield().
thread_local std::atomic<int> yields_of_thread{0};

}  // namespace

/// Takes the place of the C library's function in this program.
extern "C" int sched_yield() noexcept {
  ++yields_of_thread;
  return static_cast<int>(syscall(SYS_sched_yield));
}

namespace kilotwin::os {
namespace {

/// Calls `what` on a thread that may use one processor only.
void on_one_core(const std::function<void()>& what) {
  std::thread([&] {
    cpu_set_t cores;
    ASSERT_EQ(sched_getaffinity(0, sizeof cores, &cores), 0);
    std::size_t processor = 0;
    while (!CPU_ISSET(processor, &cores)) ++processor;
    CPU_ZERO(&cores);
    CPU_SET(processor, &cores);
    ASSERT_EQ(sched_setaffinity(0, sizeof cores, &cores), 0);
    what();
  }).join();
}

TEST(Cores, AreThoseThatTheThreadMayUse) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  EXPECT_EQ(cores(), static_cast<std::uint32_t>(CPU_COUNT(&all)));
  on_one_core([] { EXPECT_EQ(cores(), 1u); });
}

TEST(WorkerPool, RunsEachTaskOnceOnAnyNumberOfThreads) {
  for (const std::uint32_t threads : {0u, 1u, 2u, 3u, 8u}) {
    WorkerPool pool(threads);
    for (std::size_t count = 0; count < 40; ++count) {
      std::vector<int> calls(count, 0);
      pool.for_each(count, [&](std::size_t i) { ++calls[i]; });
      EXPECT_EQ(calls, std::vector<int>(count, 1));
    }
  }
}

TEST(WorkerPool, ThreadsSeeWritesOfThePreviousCall) {
  WorkerPool pool(4);
  std::vector<std::uint64_t> values(64);
  std::iota(values.begin(), values.end(), 0u);
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::uint64_t> next(values.size());
    pool.for_each(values.size(), [&](std::size_t i) { next[i] = values[(i + 1) % values.size()] * 3 + 1; });
    values = std::move(next);
  }
  std::vector<std::uint64_t> alone(64);
  std::iota(alone.begin(), alone.end(), 0u);
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::uint64_t> next(alone.size());
    for (std::size_t i = 0; i < alone.size(); ++i) next[i] = alone[(i + 1) % alone.size()] * 3 + 1;
    alone = std::move(next);
  }
  EXPECT_EQ(values, alone);
}

TEST(WorkerPool, DestructorEndsThreadsThatSearchForTasks) {
  // The thread that finishes the last task may still be in its loop when the destructor wakes all threads. It must end.
  for (int round = 0; round < 20000; ++round) {
    int calls[8] = {};
    {
      WorkerPool pool(4);
      pool.for_each(8, [&](std::size_t i) { ++calls[i]; });
    }
    ASSERT_EQ(std::accumulate(calls, calls + 8, 0), 8);
  }
}

// A thread that begins to wait while the destructor tells it to end must not sleep for ever. The delays cover that instant.
TEST(WorkerPool, DestructorEndsThreadsThatBeginToWait) {
  for (int i = 0; i < 6000; ++i) {
    WorkerPool pool(2);
    pool.for_each(2, [](std::size_t) {});
    for (int pause = 0; pause < i % 3000; ++pause) __builtin_ia32_pause();
  }
}

TEST(WorkerPool, ThrowsTheExceptionOfTheLowestTaskAndStaysUsable) {
  for (const std::uint32_t threads : {1u, 2u, 5u}) {
    WorkerPool pool(threads);
    for (int round = 0; round < 300; ++round) {
      const std::size_t first = static_cast<std::size_t>(round) % 17;
      std::string met;
      try {
        pool.for_each(20, [&](std::size_t i) {
          if (i >= first) throw std::runtime_error(std::to_string(i));
        });
      } catch (const std::runtime_error& error) {
        met = error.what();
      }
      ASSERT_EQ(met, std::to_string(first)) << threads << " threads";
      std::atomic<int> calls{0};
      pool.for_each(20, [&](std::size_t) { ++calls; });
      ASSERT_EQ(calls, 20) << "a call after a failure is as any other";
    }
  }
}

TEST(WorkerPool, SkipsTasksAfterAFailure) {
  WorkerPool pool(2);
  std::atomic<int> calls{0};
  const auto task = [&](std::size_t) {
    ++calls;
    throw 1;
  };
  EXPECT_THROW(pool.for_each(1000, task), int);
  EXPECT_LE(calls, 2) << "no more than one for each thread";
}

/// How often the calling thread of a pool of two yields while it waits for the other thread. That thread waits in its task until
/// the caller has yielded `wanted` times, at most about `patience_ms`.
int yields_while_waiting(int wanted, int patience_ms) {
  WorkerPool pool(2);
  const auto caller = std::this_thread::get_id();
  const std::atomic<int>& yields = yields_of_thread;
  const int before = yields;
  std::atomic<int> begun{0};
  const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(1)); };
  pool.for_each(2, [&](std::size_t) {
    for (++begun; begun < 2;) pause();  // each thread takes one task
    if (std::this_thread::get_id() == caller) return;
    for (int ms = 0; ms < patience_ms && yields < before + wanted; ++ms) pause();
  });
  return yields - before;
}

TEST(WorkerPool, ThreadsThatOutnumberTheCoresYield) {
  // The library's wait, which follows, yields four times itself. The pool's eight times come before.
  static constexpr int kOurs = 8;
  on_one_core([] { EXPECT_GE(yields_while_waiting(kOurs, 10'000), kOurs); });
  if (cores() >= 2) {
    EXPECT_LT(yields_while_waiting(kOurs, 50), kOurs) << "threads with a core each spin";
  }
}

TEST(InParallel, RethrowsExceptionsAndMayBeNested) {
  EXPECT_THROW(in_parallel(8, 4, [](std::size_t) { throw std::runtime_error("no"); }), std::runtime_error);
  std::vector<std::vector<int>> calls(5, std::vector<int>(7, 0));
  in_parallel(5, 3, [&](std::size_t i) { in_parallel(7, 2, [&](std::size_t k) { ++calls[i][k]; }); });
  EXPECT_EQ(calls, std::vector<std::vector<int>>(5, std::vector<int>(7, 1)));
}

}  // namespace
}  // namespace kilotwin::os
