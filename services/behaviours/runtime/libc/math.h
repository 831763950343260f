/* Mathematical functions of the C library with equal bits on every machine; core/math/elementary.h implements them. */
#ifndef KILOTWIN_MATH_H
#define KILOTWIN_MATH_H

#define M_E 2.7182818284590452354
#define M_LOG2E 1.4426950408889634074
#define M_LOG10E 0.43429448190325182765
#define M_LN2 0.69314718055994530942
#define M_LN10 2.30258509299404568402
#define M_PI 3.14159265358979323846
#define M_PI_2 1.57079632679489661923
#define M_PI_4 0.78539816339744830962
#define M_1_PI 0.31830988618379067154
#define M_2_PI 0.63661977236758134308
#define M_2_SQRTPI 1.12837916709551257390
#define M_SQRT2 1.41421356237309504880
#define M_SQRT1_2 0.70710678118654752440
#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define HUGE_VAL __builtin_inf()
#define HUGE_VALF __builtin_inff()
#define FP_NAN 0
#define FP_INFINITE 1
#define FP_ZERO 2
#define FP_SUBNORMAL 3
#define FP_NORMAL 4
#define fpclassify(x) __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x)
#define isnan(x) __builtin_isnan(x)
#define isinf(x) __builtin_isinf_sign(x)
#define isfinite(x) __builtin_isfinite(x)
#define isnormal(x) __builtin_isnormal(x)
#define signbit(x) __builtin_signbit(x)
#define isgreater(x, y) __builtin_isgreater(x, y)
#define isless(x, y) __builtin_isless(x, y)

#ifdef __cplusplus
extern "C" {
#endif

typedef double double_t;
typedef float float_t;

/* clang-format off */
#define KILOTWIN_UNARY(name) double name(double x); float name##f(float x);
#define KILOTWIN_BINARY(name) double name(double x, double y); float name##f(float x, float y);
#define KILOTWIN_WHOLE(type, name) type name(double x); type name##f(float x);
KILOTWIN_UNARY(sin) KILOTWIN_UNARY(cos) KILOTWIN_UNARY(tan) KILOTWIN_UNARY(asin) KILOTWIN_UNARY(acos)
KILOTWIN_UNARY(atan) KILOTWIN_UNARY(sinh) KILOTWIN_UNARY(cosh) KILOTWIN_UNARY(tanh) KILOTWIN_UNARY(asinh)
KILOTWIN_UNARY(acosh) KILOTWIN_UNARY(atanh) KILOTWIN_UNARY(exp) KILOTWIN_UNARY(exp2) KILOTWIN_UNARY(expm1)
KILOTWIN_UNARY(log) KILOTWIN_UNARY(log2) KILOTWIN_UNARY(log10) KILOTWIN_UNARY(log1p) KILOTWIN_UNARY(sqrt)
KILOTWIN_UNARY(cbrt) KILOTWIN_UNARY(fabs) KILOTWIN_UNARY(floor) KILOTWIN_UNARY(ceil) KILOTWIN_UNARY(round)
KILOTWIN_UNARY(trunc) KILOTWIN_UNARY(rint) KILOTWIN_UNARY(nearbyint) KILOTWIN_UNARY(square)
KILOTWIN_BINARY(atan2) KILOTWIN_BINARY(pow) KILOTWIN_BINARY(fmod) KILOTWIN_BINARY(remainder)
KILOTWIN_BINARY(hypot) KILOTWIN_BINARY(fmin) KILOTWIN_BINARY(fmax) KILOTWIN_BINARY(fdim)
KILOTWIN_BINARY(copysign)
KILOTWIN_WHOLE(long, lround) KILOTWIN_WHOLE(long, lrint)
KILOTWIN_WHOLE(long long, llround) KILOTWIN_WHOLE(long long, llrint)
#undef KILOTWIN_UNARY
#undef KILOTWIN_BINARY
#undef KILOTWIN_WHOLE
    /* clang-format on */
    double fma(double x, double y, double z);
float fmaf(float x, float y, float z);
double modf(double x, double* whole);
float modff(float x, float* whole);
double frexp(double x, int* exponent);
float frexpf(float x, int* exponent);
double ldexp(double x, int exponent);
float ldexpf(float x, int exponent);
void sincos(double x, double* sine, double* cosine);
void sincosf(float x, float* sine, float* cosine);

#ifdef __cplusplus
}
#endif

#endif
