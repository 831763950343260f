// The inner loops of contact, with what every processor of the family has. CMakeLists.txt says so to the compiler.
#include "services/physics/contact_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kBaselineKernel;
const ContactKernel kBaselineKernel = {"baseline", face, pass};

}  // namespace kilotwin::physics
