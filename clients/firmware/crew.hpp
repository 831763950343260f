/// Threads that share short tasks, thousands of times a second: between two calls they look for the next one a while before
/// they go to sleep.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace kilotwin::firmware {

class Crew {
 public:
  /// `threads`: with the caller's own.
  explicit Crew(std::uint32_t threads) {
    for (std::uint32_t i = 1; i < threads; ++i) hands_.emplace_back([this] { serve(); });
  }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;
  ~Crew() {
    ended_ = true;
    round_.fetch_add(1);
    round_.notify_all();
    for (std::thread& hand : hands_) hand.join();
  }

  /// Calls task(i) once for each i below `count`, in any order on any thread; returns when all are done. Tasks do not throw.
  void share(std::uint32_t count, const std::function<void(std::uint32_t)>& task) {
    if (hands_.empty() || count < 2) {
      for (std::uint32_t i = 0; i < count; ++i) task(i);
      return;
    }
    task_ = &task;
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    working_.store(static_cast<std::uint32_t>(hands_.size()), std::memory_order_relaxed);
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
    work();
    wait(working_, [](std::uint32_t working) { return working == 0; });
  }

 private:
  /// Looks so often before it sleeps: some 10 us.
  static constexpr int kLooks = 2000;

  template <class Done> static std::uint32_t wait(std::atomic<std::uint32_t>& value, Done done) {
    for (int look = 0;; ++look) {
      const std::uint32_t now = value.load(std::memory_order_acquire);
      if (done(now)) return now;
      if (look >= kLooks) value.wait(now, std::memory_order_acquire);
    }
  }
  void work() {
    for (std::uint32_t i = next_++; i < count_; i = next_++) (*task_)(i);
  }
  void serve() {
    for (std::uint32_t seen = 0;;) {
      seen = wait(round_, [seen](std::uint32_t round) { return round != seen; });
      if (ended_) return;
      work();
      if (working_.fetch_sub(1, std::memory_order_acq_rel) == 1) working_.notify_one();
    }
  }

  const std::function<void(std::uint32_t)>* task_ = nullptr;
  std::uint32_t count_ = 0;
  std::atomic<std::uint32_t> next_{0}, working_{0}, round_{0};
  std::atomic<bool> ended_{false};
  std::vector<std::thread> hands_;
};

}  // namespace kilotwin::firmware
