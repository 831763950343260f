#include "clients/arenas/shared_arrays.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::arenas {
namespace {

constexpr std::size_t kAlignment = 64;  ///< a line of the cache

std::size_t size_of(const ArrayLayout& array) {
  std::size_t octets = static_cast<std::size_t>(array.type.back() - '0');
  for (const std::size_t extent : array.shape) octets *= extent;
  return octets;
}

}  // namespace

SharedArrays::SharedArrays(std::vector<ArrayLayout> arrays) : arrays_(std::move(arrays)) {
  for (ArrayLayout& array : arrays_) {
    array.offset = octets_;
    array.octets = size_of(array);
    octets_ += (array.octets + kAlignment - 1) / kAlignment * kAlignment;
  }
  descriptor_ = memfd_create("kilotwin-arenas", MFD_CLOEXEC);
  void* memory = MAP_FAILED;
  if (descriptor_ >= 0 && ftruncate(descriptor_, static_cast<off_t>(octets_)) == 0)
    memory = mmap(nullptr, octets_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
  if (memory == MAP_FAILED) {
    const std::string reason = os::system_reason();
    if (descriptor_ >= 0) close(descriptor_);
    throw RunError(fmt::format("no {} octets of shared memory: {}; give fewer arenas", octets_, reason));
  }
  memory_ = static_cast<std::byte*>(memory);
}

SharedArrays::~SharedArrays() {
  munmap(memory_, octets_);
  close(descriptor_);
}

}  // namespace kilotwin::arenas
