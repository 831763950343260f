// The inner loops of contact, for processors with AVX2. CMakeLists.txt says so to the compiler.
#include "services/physics/contact_kernel_body.hpp"

namespace kilotwin::physics {

extern const ContactKernel kAvx2Kernel;
const ContactKernel kAvx2Kernel = {"AVX2", face, pass};

}  // namespace kilotwin::physics
