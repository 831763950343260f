// The inner loops for processors with AVX2. CMakeLists.txt sets the compiler option.
#include "services/physics/contact_kernel_body.hpp"
#include "services/physics/drive_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kAvx2Kernel;
const ContactKernel kAvx2Kernel = {"AVX2", begin, pass, move_free, any_moved};

extern const DriveKernel kAvx2DriveKernel;
const DriveKernel kAvx2DriveKernel = {"AVX2", integrate};

}  // namespace kilotwin::physics
