#include "core/os/limits.hpp"

#include <sys/resource.h>

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin {

void require_open_files(std::uint64_t count, const std::string& what) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= count) return;
  const rlim_t before = limit.rlim_cur;
  limit.rlim_cur = std::min<rlim_t>(count, limit.rlim_max);
  if (limit.rlim_cur == count && setrlimit(RLIMIT_NOFILE, &limit) == 0) return;
  throw RunError(what + " needs " + std::to_string(count) + " open files at a time, and the limit is " +
                 std::to_string(before) + "; raise it with: ulimit -n " +
                 std::to_string(std::max<std::uint64_t>(1024, count)) +
                 " (if the shell refuses, raise nofile in /etc/security/limits.conf)");
}

}  // namespace kilotwin
