/// Threads that share short tasks, thousands of times a second: between two calls they look for the next one a while before
/// they go to sleep.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace kilotwin::firmware {

class WorkerPool {
 public:
  /// `threads`: with the caller's own.
  explicit WorkerPool(std::uint32_t threads) {
    for (std::uint32_t i = 1; i < threads; ++i) threads_.emplace_back([this] { serve(); });
  }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool() {
    ended_ = true;
    unclaimed_.store(1, std::memory_order_release);
    unclaimed_.notify_all();
    for (std::thread& hand : threads_) hand.join();
  }

  /// Calls task(i) once for each i below `count`, in any order on any thread; returns when all are done. Tasks do not throw.
  /// A hand that the system does not let run costs nothing: whoever is awake takes what is left.
  void share(std::uint32_t count, const std::function<void(std::uint32_t)>& task) {
    if (threads_.empty() || count < 2) {
      for (std::uint32_t i = 0; i < count; ++i) task(i);
      return;
    }
    task_ = &task;
    unfinished_.store(count, std::memory_order_relaxed);
    unclaimed_.store(count, std::memory_order_release);
    unclaimed_.notify_all();
    work();
    wait(unfinished_, [](std::uint32_t unfinished) { return unfinished == 0; });
  }

 private:
  /// Looks so often before it sleeps, with a pause of 10 to 50 ns after each look: for some tens of us, longer than one thread
  /// alone works between two rounds. To wake a thread that sleeps takes as long as several robots' tasks.
  static constexpr int kLooks = 2000;

  template <class Done> static void wait(std::atomic<std::uint32_t>& value, Done done) {
    for (int look = 0;; ++look) {
      const std::uint32_t now = value.load(std::memory_order_acquire);
      if (done(now)) return;
      if (look >= kLooks)
        value.wait(now, std::memory_order_acquire);
      else
        __builtin_ia32_pause();
    }
  }
  /// Whoever brings `unclaimed_` from n to n - 1 has task n - 1 of the round of that moment, which cannot end before it is
  /// done: so a hand that slept through rounds still claims right.
  void work() {
    for (std::uint32_t n = unclaimed_.load(std::memory_order_acquire); n != 0;) {
      if (!unclaimed_.compare_exchange_weak(n, n - 1, std::memory_order_acq_rel, std::memory_order_acquire))
        continue;
      (*task_)(n - 1);
      if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1) unfinished_.notify_one();
      n = unclaimed_.load(std::memory_order_acquire);
    }
  }
  void serve() {
    for (;;) {
      wait(unclaimed_, [](std::uint32_t unclaimed) { return unclaimed != 0; });
      if (ended_) return;
      work();
    }
  }

  const std::function<void(std::uint32_t)>* task_ = nullptr;
  std::atomic<std::uint32_t> unclaimed_{0}, unfinished_{0};
  std::atomic<bool> ended_{false};
  std::vector<std::thread> threads_;
};

}  // namespace kilotwin::firmware
