/* The compiler's fixed-width types. There is no other C library. */
#ifdef __clang__
#include_next <stdint.h>
#else
#include <stdint-gcc.h>
#endif
