/// SharedArrays: arrays of numbers in memory that another process maps, at /proc/PID/fd/N.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kilotwin::arenas {

/// An array in row-major order.
struct ArrayLayout {
  std::string name;
  std::string type;  ///< as NumPy names it: f8, i8, u8, u4, u1
  std::vector<std::size_t> shape;
  std::size_t offset = 0, octets = 0;
};

class SharedArrays {
 public:
  /// Sets the arrays' offsets and allocates zeroed memory for all. Throws RunError if there is too little memory.
  explicit SharedArrays(std::vector<ArrayLayout> arrays);
  ~SharedArrays();
  SharedArrays(const SharedArrays&) = delete;
  SharedArrays& operator=(const SharedArrays&) = delete;

  [[nodiscard]] const std::vector<ArrayLayout>& layout() const { return arrays_; }
  [[nodiscard]] std::size_t octets() const { return octets_; }
  /// File descriptor of the memory, for other processes to map.
  [[nodiscard]] int descriptor() const { return descriptor_; }
  /// The elements of array `index`, whose type is T.
  template <class T> [[nodiscard]] std::span<T> array(std::size_t index) const {
    const ArrayLayout& array = arrays_[index];
    return {reinterpret_cast<T*>(memory_ + array.offset), array.octets / sizeof(T)};  // NOLINT
  }

 private:
  std::vector<ArrayLayout> arrays_;
  std::size_t octets_ = 0;
  int descriptor_ = -1;
  std::byte* memory_ = nullptr;
};

}  // namespace kilotwin::arenas
