/* The names of the C library's mathematics over core/math/elementary.h. */
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
double fmin(double x, double y) { return isnan(x) || y < x ? y : x; }
double fmax(double x, double y) { return isnan(x) || y > x ? y : x; }

/* To the nearest integer, halves away from zero. */
double round(double x) {
  const double whole = trunc(x), rest = fabs(x - whole);
  return rest >= 0.5 ? whole + copysign(1, x) : whole;
}

long lround(double x) { return (long)round(x); }

/* To the nearest integer, halves to even. */
long lrint(double x) {
  const double low = kt_floor(x), rest = x - low;
  const long whole = (long)low;
  return rest > 0.5 || (rest == 0.5 && (whole & 1)) ? whole + 1 : whole;
}

/* One instruction, correctly rounded. */
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

#define UNARY(name) \
  float name##f(float x) { return (float)name(x); }
#define BINARY(name) \
  float name##f(float x, float y) { return (float)name(x, y); }
UNARY(sin)
UNARY(cos)
UNARY(tan) UNARY(asin) UNARY(acos) UNARY(atan) UNARY(exp) UNARY(log) UNARY(log2) UNARY(log10) UNARY(fabs)
    UNARY(floor) UNARY(ceil) UNARY(round) UNARY(trunc) UNARY(square) UNARY(sinh) UNARY(cosh) UNARY(tanh)
        BINARY(atan2) BINARY(pow) BINARY(fmod) BINARY(hypot) BINARY(fmin) BINARY(fmax) BINARY(copysign)
