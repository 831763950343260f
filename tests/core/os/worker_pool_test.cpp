// The worker pool: every task runs once, the caller gets exceptions, the destructor does not dead-lock.
#include "core/os/worker_pool.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace kilotwin::os {
namespace {

TEST(Cores, AreThoseThatTheThreadMayUse) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  EXPECT_EQ(cores(), static_cast<std::uint32_t>(CPU_COUNT(&all)));
  std::thread([&] {
    std::size_t processor = 0;
    while (!CPU_ISSET(processor, &all)) ++processor;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(processor, &one);
    ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
    EXPECT_EQ(cores(), 1u);
  }).join();
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

TEST(InParallel, RethrowsExceptionsAndMayBeNested) {
  EXPECT_THROW(in_parallel(8, 4, [](std::size_t) { throw std::runtime_error("no"); }), std::runtime_error);
  std::vector<std::vector<int>> calls(5, std::vector<int>(7, 0));
  in_parallel(5, 3, [&](std::size_t i) { in_parallel(7, 2, [&](std::size_t k) { ++calls[i][k]; }); });
  EXPECT_EQ(calls, std::vector<std::vector<int>>(5, std::vector<int>(7, 1)));
}

}  // namespace
}  // namespace kilotwin::os
