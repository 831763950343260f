// The inner loops, for processors with AVX2. CMakeLists.txt says so to the compiler.
#include "services/physics/contact_kernel_body.hpp"
#include "services/physics/drive_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kAvx2Kernel;
const ContactKernel kAvx2Kernel = {"AVX2", begin, pass, roll, any_moved};

extern const DriveKernel kAvx2DriveKernel;
const DriveKernel kAvx2DriveKernel = {"AVX2", integrate};

}  // namespace kilotwin::physics
