// Selects the inner loops that this processor can run.
#include "services/physics/contact_batch.hpp"
#include "services/physics/drive_kernel.hpp"

namespace kilotwin::physics {

extern const ContactKernel kBaselineKernel;
extern const DriveKernel kBaselineDriveKernel;
#if defined(__x86_64__)
extern const ContactKernel kAvx2Kernel, kAvx512Kernel;
extern const DriveKernel kAvx2DriveKernel, kAvx512DriveKernel;
#endif

namespace {

template <class Kernel>
std::size_t fastest_first(const Kernel* (&kernels)[3], [[maybe_unused]] const Kernel* avx512,
                          [[maybe_unused]] const Kernel* avx2, const Kernel* baseline) {
  std::size_t count = 0;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) kernels[count++] = avx512;
  if (__builtin_cpu_supports("avx2")) kernels[count++] = avx2;
#endif
  kernels[count++] = baseline;
  return count;
}

}  // namespace

#if defined(__x86_64__)
std::size_t contact_kernels(const ContactKernel* (&kernels)[3]) {
  return fastest_first(kernels, &kAvx512Kernel, &kAvx2Kernel, &kBaselineKernel);
}
std::size_t drive_kernels(const DriveKernel* (&kernels)[3]) {
  return fastest_first(kernels, &kAvx512DriveKernel, &kAvx2DriveKernel, &kBaselineDriveKernel);
}
#else
std::size_t contact_kernels(const ContactKernel* (&kernels)[3]) {
  return fastest_first<ContactKernel>(kernels, nullptr, nullptr, &kBaselineKernel);
}
std::size_t drive_kernels(const DriveKernel* (&kernels)[3]) {
  return fastest_first<DriveKernel>(kernels, nullptr, nullptr, &kBaselineDriveKernel);
}
#endif

}  // namespace kilotwin::physics
