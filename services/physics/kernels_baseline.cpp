// The inner loops for any processor of the family.
#include "services/physics/contact_kernel_body.hpp"
#include "services/physics/drive_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kBaselineKernel;
const ContactKernel kBaselineKernel = {"baseline", begin, pass, move_free, any_moved};

extern const DriveKernel kBaselineDriveKernel;
const DriveKernel kBaselineDriveKernel = {"baseline", integrate};

}  // namespace kilotwin::physics
