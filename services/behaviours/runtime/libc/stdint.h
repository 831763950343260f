/* The compiler's own fixed-width types; there is no C library beneath. */
#ifdef __clang__
#include_next <stdint.h>
#else
#include <stdint-gcc.h>
#endif
