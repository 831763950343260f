/// A worker pool for short tasks, called thousands of times a second.
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

/// Processors that the calling thread may use, at least 1: those of the machine without what `taskset`, a cpuset or a job of Slurm
/// withholds.
[[nodiscard]] std::uint32_t cores();

/// Between two calls the threads spin for some tens of us before they sleep, because waking a thread costs as much as several
/// tasks. If there are more threads than cores, they yield and do not spin: a spinning thread would take a core from a working one.
class WorkerPool {
 public:
  using Task = std::function<void(std::size_t)>;

  /// `threads` counts the caller's thread; 0 means 1.
  explicit WorkerPool(std::uint32_t threads);
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool();

  [[nodiscard]] std::uint32_t threads() const { return static_cast<std::uint32_t>(threads_.size() + 1); }

  /// Calls task(i) once for each i < count (at most 2^32 - 2) and returns when all are done. Tasks start in ascending order. A
  /// thread that the system does not schedule delays nobody: the others take the remaining tasks. If a task throws, tasks that
  /// have not started are skipped. for_each() then rethrows the exception of the lowest i, the one that a single thread would
  /// meet. Only one call may be active, and tasks must not call the pool that runs them.
  void for_each(std::size_t count, const Task& task);

 private:
  void wait_while(std::atomic<std::uint32_t>& value, std::uint32_t unwanted) const;
  void work();
  void serve();
  void run(std::size_t i);
  void fail(std::size_t i);

  // The current call's tasks. Written only while no thread has a task.
  const Task* task_ = nullptr;
  std::size_t count_ = 0;

  /// Number of tasks that no thread has taken, or kEnd. The thread that lowers it from n to n - 1 takes task
  /// (count_ - n). The current call cannot end before that task is done, so a thread that slept through calls still reads the right task_.
  std::atomic<std::uint32_t> unclaimed_{0};
  std::atomic<std::uint32_t> unfinished_{0};
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::size_t failed_ = 0;  ///< the task that threw failure_
  int spins_ = 0;
  std::vector<std::thread> threads_;
};

/// WorkerPool::for_each() on a temporary pool, for tasks that take much longer than the start of a thread. May be nested.
void in_parallel(std::size_t count, std::uint32_t threads, const WorkerPool::Task& task);

}  // namespace kilotwin::os
