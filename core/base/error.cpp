#include "core/base/error.hpp"

#include <cstdio>
#include <cstdlib>

namespace kilotwin {

void demand_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "kilotwin: defect: %s:%d: expected %s\n", file, line, condition);
  std::abort();
}

}  // namespace kilotwin
