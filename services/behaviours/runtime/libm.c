/* The mathematical functions of the C library, implemented by core/math/elementary.h. */
#include <math.h>

#include "core/math/elementary.h"
#include "weak.h"

double sin(double x) { return kt_sin(x); }
double cos(double x) { return kt_cos(x); }
double tan(double x) { return kt_tan(x); }
double asin(double x) { return kt_asin(x); }
double acos(double x) { return kt_acos(x); }
double atan(double x) { return kt_atan(x); }
double atan2(double y, double x) { return kt_atan2(y, x); }
double exp(double x) { return kt_exp(x); }
double log(double x) { return kt_log(x); }
double log2(double x) { return kt_log(x) / M_LN2; }
double log10(double x) { return kt_log(x) / M_LN10; }
double pow(double x, double y) { return kt_pow(x, y); }
double fmod(double x, double y) { return kt_fmod(x, y); }
double hypot(double x, double y) { return kt_hypot(x, y); }
double floor(double x) { return kt_floor(x); }
double ceil(double x) { return -kt_floor(-x); }
double trunc(double x) { return x < 0 ? ceil(x) : kt_floor(x); }
double fabs(double x) { return __builtin_fabs(x); }
double copysign(double x, double y) { return __builtin_copysign(x, y); }
double square(double x) { return x * x; }
double sinh(double x) { return (kt_exp(x) - kt_exp(-x)) / 2; }
double cosh(double x) { return (kt_exp(x) + kt_exp(-x)) / 2; }
double tanh(double x) { return x > 20 ? 1 : x < -20 ? -1 : 1 - 2 / (kt_exp(2 * x) + 1); }
double asinh(double x) {
  const double size = fabs(x);
  return copysign(kt_log(size + sqrt(size * size + 1)), x);
}
double acosh(double x) { return kt_log(x + sqrt(x * x - 1)); }
double atanh(double x) { return kt_log((1 + x) / (1 - x)) / 2; }
double exp2(double x) { return kt_pow(2, x); }
double expm1(double x) { return fabs(x) < 1e-5 ? x + x * x / 2 : kt_exp(x) - 1; }
double log1p(double x) { return fabs(x) < 1e-5 ? x - x * x / 2 : kt_log(1 + x); }
double fdim(double x, double y) { return x > y ? x - y : 0; }
double fma(double x, double y, double z) { return x * y + z; }

/* exp(log(x) / 3), improved by one step of Newton's method. */
double cbrt(double x) {
  if (x == 0 || x - x != 0) return x;
  const double size = fabs(x);
  const double root = kt_exp(kt_log(size) / 3);
  return copysign(root - (root - size / (root * root)) / 3, x);
}

double modf(double x, double* whole) {
  *whole = trunc(x);
  return isinf(x) ? copysign(0, x) : copysign(x - *whole, x);
}

double frexp(double x, int* exponent) {
  *exponent = 0;
  if (x == 0 || x - x != 0) return x;
  for (; fabs(x) >= 1; x /= 2) ++*exponent;
  for (; fabs(x) < 0.5; x *= 2) --*exponent;
  return x;
}

double ldexp(double x, int exponent) {
  for (; exponent > 0 && x - x == 0; --exponent) x *= 2;
  for (; exponent < 0 && x != 0; ++exponent) x /= 2;
  return x;
}

void sincos(double x, double* sine, double* cosine) {
  *sine = kt_sin(x);
  *cosine = kt_cos(x);
}

double fmin(double x, double y) { return isnan(x) || y < x ? y : x; }
double fmax(double x, double y) { return isnan(x) || y > x ? y : x; }

/* Rounds to the nearest integer, halves away from zero. */
double round(double x) {
  const double whole = trunc(x), rest = fabs(x - whole);
  return rest >= 0.5 ? whole + copysign(1, x) : whole;
}

/* Rounds to the nearest integer, halves to even. */
double rint(double x) {
  const double low = kt_floor(x), rest = x - low;
  if (rest != 0.5) return rest > 0.5 ? low + 1 : low;
  return kt_floor(low / 2) * 2 == low ? low : low + 1;
}
double nearbyint(double x) { return rint(x); }

double remainder(double x, double y) {
  const double rest = kt_fmod(x, y), half = fabs(y) / 2;
  if (fabs(rest) < half || (fabs(rest) == half && !(lrint((x - rest) / y) & 1))) return rest;
  return rest - copysign(y, rest);
}

long lround(double x) { return (long)round(x); }
long lrint(double x) { return (long)rint(x); }
long long llround(double x) { return (long long)round(x); }
long long llrint(double x) { return (long long)rint(x); }

/* A single instruction, whose result is correctly rounded. */
double sqrt(double x) {
  double root;
  __asm__("sqrtsd %1, %0" : "=x"(root) : "x"(x));
  return root;
}

float sqrtf(float x) {
  float root;
  __asm__("sqrtss %1, %0" : "=x"(root) : "x"(x));
  return root;
}

/* clang-format off */
#define UNARY(name) float name##f(float x) { return (float)name(x); }
#define BINARY(name) float name##f(float x, float y) { return (float)name(x, y); }
UNARY(sin) UNARY(cos) UNARY(tan) UNARY(asin) UNARY(acos) UNARY(atan) UNARY(sinh) UNARY(cosh) UNARY(tanh)
UNARY(asinh) UNARY(acosh) UNARY(atanh) UNARY(exp) UNARY(exp2) UNARY(expm1) UNARY(log) UNARY(log2) UNARY(log10)
UNARY(log1p) UNARY(cbrt) UNARY(fabs) UNARY(floor) UNARY(ceil) UNARY(round) UNARY(trunc) UNARY(rint)
UNARY(nearbyint) UNARY(square)
BINARY(atan2) BINARY(pow) BINARY(fmod) BINARY(remainder) BINARY(hypot) BINARY(fmin) BINARY(fmax) BINARY(fdim)
BINARY(copysign)
    /* clang-format on */
    long lroundf(float x) {
  return lround(x);
}
long lrintf(float x) { return lrint(x); }
long long llroundf(float x) { return llround(x); }
long long llrintf(float x) { return llrint(x); }
float fmaf(float x, float y, float z) { return (float)((double)x * y + z); }
float frexpf(float x, int* exponent) { return (float)frexp(x, exponent); }
float ldexpf(float x, int exponent) { return (float)ldexp(x, exponent); }

float modff(float x, float* whole) {
  double part;
  const float rest = (float)modf(x, &part);
  *whole = (float)part;
  return rest;
}

void sincosf(float x, float* sine, float* cosine) {
  *sine = sinf(x);
  *cosine = cosf(x);
}
