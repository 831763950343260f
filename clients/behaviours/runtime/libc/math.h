/* Mathematics with the same last bit on every machine: core/math/elementary.h under the names of the C library. */
#ifndef KILOTWIN_MATH_H
#define KILOTWIN_MATH_H

#define M_E 2.7182818284590452354
#define M_LN2 0.69314718055994530942
#define M_LN10 2.30258509299404568402
#define M_PI 3.14159265358979323846
#define M_PI_2 1.57079632679489661923
#define M_PI_4 0.78539816339744830962
#define M_1_PI 0.31830988618379067154
#define M_2_PI 0.63661977236758134308
#define M_SQRT2 1.41421356237309504880
#define M_SQRT1_2 0.70710678118654752440
#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define HUGE_VAL __builtin_inf()
#define isnan(x) __builtin_isnan(x)
#define isinf(x) __builtin_isinf(x)
#define isfinite(x) __builtin_isfinite(x)
#define signbit(x) __builtin_signbit(x)

#define KILOTWIN_UNARY(name) \
  double name(double x);     \
  float name##f(float x);
#define KILOTWIN_BINARY(name)      \
  double name(double x, double y); \
  float name##f(float x, float y);
KILOTWIN_UNARY(sin)
KILOTWIN_UNARY(cos)
KILOTWIN_UNARY(tan) KILOTWIN_UNARY(asin) KILOTWIN_UNARY(acos) KILOTWIN_UNARY(atan) KILOTWIN_UNARY(exp)
    KILOTWIN_UNARY(log) KILOTWIN_UNARY(log2) KILOTWIN_UNARY(log10) KILOTWIN_UNARY(sqrt) KILOTWIN_UNARY(fabs)
        KILOTWIN_UNARY(floor) KILOTWIN_UNARY(ceil) KILOTWIN_UNARY(round) KILOTWIN_UNARY(trunc)
            KILOTWIN_UNARY(square) KILOTWIN_UNARY(sinh) KILOTWIN_UNARY(cosh) KILOTWIN_UNARY(tanh)
                KILOTWIN_BINARY(atan2) KILOTWIN_BINARY(pow) KILOTWIN_BINARY(fmod) KILOTWIN_BINARY(hypot)
                    KILOTWIN_BINARY(fmin) KILOTWIN_BINARY(fmax) KILOTWIN_BINARY(copysign)
#undef KILOTWIN_UNARY
#undef KILOTWIN_BINARY
                        long lround(double x);
long lrint(double x);

#endif
