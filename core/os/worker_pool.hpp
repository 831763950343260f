/// Threads that share short tasks, thousands of times a second.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace kilotwin::os {

/// Processors that this process may use, at least 1.
[[nodiscard]] std::uint32_t cores();

/// Between two calls, threads spin for some tens of us before they sleep, as waking a thread costs as much as several tasks.
/// Where there are more threads than cores they yield instead: a thread that spins would keep a core from one that works.
class WorkerPool {
 public:
  using Task = std::function<void(std::size_t)>;

  /// `threads`: the caller's own included; 0 is taken as 1.
  explicit WorkerPool(std::uint32_t threads);
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool();

  [[nodiscard]] std::uint32_t threads() const { return static_cast<std::uint32_t>(threads_.size() + 1); }

  /// Calls task(i) once for each i below `count` (at most 2^32 - 2), started in ascending order, and returns when all are done.
  /// A thread that the system does not let run delays nobody: the others take what is left. Where tasks throw, those that have
  /// not started are left out, and the exception of the lowest i is thrown again here: the one that a single thread would meet.
  /// One call at a time; tasks do not call the pool that runs them.
  void for_each(std::size_t count, const Task& task);

 private:
  void wait_while(std::atomic<std::uint32_t>& value, std::uint32_t unwanted) const;
  void work();
  void serve();
  void run(std::size_t i);
  void fail(std::size_t i);

  // Of the call at hand; written while no thread has a task.
  const Task* task_ = nullptr;
  std::size_t count_ = 0;

  /// Tasks that nobody has taken, or kEnd. Whoever brings it from n to n - 1 has task count_ - n of the call of that moment,
  /// which cannot end before it is done: a thread that slept through calls still takes a task of the right one.
  std::atomic<std::uint32_t> unclaimed_{0};
  std::atomic<std::uint32_t> unfinished_{0};
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::size_t failed_ = 0;  ///< the task that threw failure_
  int spins_ = 0;
  std::vector<std::thread> threads_;
};

/// WorkerPool::for_each() on threads of its own, for tasks that take much longer than to start a thread. May be nested.
void in_parallel(std::size_t count, std::uint32_t threads, const WorkerPool::Task& task);

}  // namespace kilotwin::os
