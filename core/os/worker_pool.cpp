#include "core/os/worker_pool.hpp"

#include <sched.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::os {
namespace {

/// Value of `unclaimed_` that tells the threads to end. No call has that many tasks.
constexpr std::uint32_t kEnd = 0xffffffff;
/// One spin is a pause of 10 to 50 ns. All spins take some tens of us, longer than the caller works between two calls.
constexpr int kSpins = 2000;
/// Used if threads outnumber cores. One yield may last as long as another thread's time slice, so a few suffice.
constexpr int kYields = 8;

/// Sets a value and wakes the threads that wait for it. notify_all() finds waiting threads by a load, which must not overtake the
/// store: a thread that begins to wait between both would sleep for ever. So the store is sequentially consistent.
void announce(std::atomic<std::uint32_t>& value, std::uint32_t to) {
  value.store(to, std::memory_order_seq_cst);
  value.notify_all();
}

}  // namespace

std::uint32_t cores() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return static_cast<std::uint32_t>(CPU_COUNT(&allowed));
  return std::max(1u, std::thread::hardware_concurrency());  // a machine of more than 1024 processors
}

WorkerPool::WorkerPool(std::uint32_t threads) : spins_(threads <= cores() ? kSpins : 0) {
  try {
    for (std::uint32_t i = 1; i < threads; ++i) threads_.emplace_back([this] { serve(); });
  } catch (const std::system_error&) {
    // The system has no room for more threads. The threads that exist do the work.
  }
}

WorkerPool::~WorkerPool() {
  announce(unclaimed_, kEnd);
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::for_each(std::size_t count, const Task& task) {
  KILOTWIN_DEMAND(count < kEnd);
  if (threads_.empty() || count < 2) {
    for (std::size_t i = 0; i < count; ++i) task(i);
    return;
  }
  task_ = &task;
  count_ = count;
  unfinished_.store(static_cast<std::uint32_t>(count), std::memory_order_relaxed);
  announce(unclaimed_, static_cast<std::uint32_t>(count));
  work();
  for (std::uint32_t n = unfinished_.load(std::memory_order_acquire); n != 0;
       n = unfinished_.load(std::memory_order_acquire)) {
    wait_while(unfinished_, n);
  }
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void WorkerPool::wait_while(std::atomic<std::uint32_t>& value, std::uint32_t unwanted) const {
  for (int i = 0; i < spins_; ++i) {
    if (value.load(std::memory_order_acquire) != unwanted) return;
    __builtin_ia32_pause();
  }
  for (int i = 0; spins_ == 0 && i < kYields; ++i) {
    if (value.load(std::memory_order_acquire) != unwanted) return;
    sched_yield();
  }
  value.wait(unwanted, std::memory_order_acquire);
}

void WorkerPool::work() {
  for (std::uint32_t n = unclaimed_.load(std::memory_order_acquire); n != 0 && n != kEnd;) {
    if (!unclaimed_.compare_exchange_weak(n, n - 1, std::memory_order_acq_rel, std::memory_order_acquire)) continue;
    run(count_ - n);
    n = unclaimed_.load(std::memory_order_acquire);
  }
}

void WorkerPool::run(std::size_t i) {
  std::uint32_t done = 1;
  try {
    (*task_)(i);
  } catch (...) {
    fail(i);
    // This task is unfinished, so the call has not ended and all unclaimed tasks belong to it.
    done += unclaimed_.exchange(0, std::memory_order_acq_rel);
  }
  if (unfinished_.fetch_sub(done, std::memory_order_acq_rel) == done) unfinished_.notify_one();
}

void WorkerPool::fail(std::size_t i) {
  const std::lock_guard lock(failure_mutex_);
  if (failure_ && failed_ < i) return;
  failure_ = std::current_exception();
  failed_ = i;
}

void WorkerPool::serve() {
  for (;;) {
    wait_while(unclaimed_, 0);
    if (unclaimed_.load(std::memory_order_acquire) == kEnd) return;
    work();
  }
}

void in_parallel(std::size_t count, std::uint32_t threads, const WorkerPool::Task& task) {
  WorkerPool pool(static_cast<std::uint32_t>(std::min<std::size_t>(threads, count)));
  pool.for_each(count, task);
}

}  // namespace kilotwin::os
