// The inner loops, with what every processor of the family has. CMakeLists.txt says so to the compiler.
#include "services/physics/contact_kernel_body.hpp"
#include "services/physics/drive_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kBaselineKernel;
const ContactKernel kBaselineKernel = {"baseline", begin, pass, roll, any_moved};

extern const DriveKernel kBaselineDriveKernel;
const DriveKernel kBaselineDriveKernel = {"baseline", integrate};

}  // namespace kilotwin::physics
