/* The C library's mathematics for plugins, over core/math/elementary.h: the same bits on every machine. Compiled into each
 * plugin, hidden from everything else. */
#include "core/math/elementary.h"

double sin(double x) { return kt_sin(x); }
double cos(double x) { return kt_cos(x); }
double tan(double x) { return kt_tan(x); }
double asin(double x) { return kt_asin(x); }
double acos(double x) { return kt_acos(x); }
double atan(double x) { return kt_atan(x); }
double atan2(double y, double x) { return kt_atan2(y, x); }
double exp(double x) { return kt_exp(x); }
double log(double x) { return kt_log(x); }
double log2(double x) { return kt_log(x) / 0.693147180559945309417; }
double log10(double x) { return kt_log(x) / 2.30258509299404568402; }
double pow(double x, double y) { return kt_pow(x, y); }
double fmod(double x, double y) { return kt_fmod(x, y); }
double hypot(double x, double y) { return kt_hypot(x, y); }
void sincos(double x, double* s, double* c) { kt_sincos(x, s, c); }

float sinf(float x) { return (float)kt_sin(x); }
float cosf(float x) { return (float)kt_cos(x); }
float tanf(float x) { return (float)kt_tan(x); }
float asinf(float x) { return (float)kt_asin(x); }
float acosf(float x) { return (float)kt_acos(x); }
float atanf(float x) { return (float)kt_atan(x); }
float atan2f(float y, float x) { return (float)kt_atan2(y, x); }
float expf(float x) { return (float)kt_exp(x); }
float logf(float x) { return (float)kt_log(x); }
float log2f(float x) { return (float)log2(x); }
float log10f(float x) { return (float)log10(x); }
float powf(float x, float y) { return (float)kt_pow(x, y); }
float fmodf(float x, float y) { return (float)kt_fmod(x, y); }
float hypotf(float x, float y) { return (float)kt_hypot(x, y); }
void sincosf(float x, float* s, float* c) {
  *s = sinf(x);
  *c = cosf(x);
}
