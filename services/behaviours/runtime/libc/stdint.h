/* The compiler's fixed-width types. There is no other C library. */
#ifdef __clang__
#include_next <stdint.h>
#else
#include <stdint-gcc.h>
#endif
/* A single L has 32 bits in programs with the robot's int: services/behaviours/robot_int.hpp. */
#undef INT64_C
#undef UINT64_C
#undef INTMAX_C
#undef UINTMAX_C
#define INT64_C(c) c##LL
#define UINT64_C(c) c##ULL
#define INTMAX_C(c) c##LL
#define UINTMAX_C(c) c##ULL
