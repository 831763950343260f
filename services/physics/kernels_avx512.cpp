// The inner loops for processors with AVX-512. CMakeLists.txt sets the compiler option.
#include "services/physics/contact_kernel_body.hpp"
#include "services/physics/drive_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kAvx512Kernel;
const ContactKernel kAvx512Kernel = {"AVX-512", begin, pass, move_free, any_moved};

extern const DriveKernel kAvx512DriveKernel;
const DriveKernel kAvx512DriveKernel = {"AVX-512", integrate};

}  // namespace kilotwin::physics
