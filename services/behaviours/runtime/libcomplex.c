/* Complex functions, computed from real ones. */
#include <complex.h>
#include <math.h>

#include "weak.h"

static double _Complex from(double re, double im) {
  double _Complex z;
  __real__ z = re;
  __imag__ z = im;
  return z;
}

static double _Complex polar(double size, double angle) { return from(size * cos(angle), size * sin(angle)); }

double creal(double _Complex z) { return __real__ z; }
double cimag(double _Complex z) { return __imag__ z; }
double cabs(double _Complex z) { return hypot(__real__ z, __imag__ z); }
double carg(double _Complex z) { return atan2(__imag__ z, __real__ z); }
double _Complex conj(double _Complex z) { return from(__real__ z, -__imag__ z); }
double _Complex cexp(double _Complex z) { return polar(exp(__real__ z), __imag__ z); }
double _Complex clog(double _Complex z) { return from(log(cabs(z)), carg(z)); }
double _Complex csqrt(double _Complex z) { return polar(sqrt(cabs(z)), carg(z) / 2); }

double _Complex cpow(double _Complex z, double _Complex w) {
  if (z == 0) return w == 0 ? 1 : 0;
  const double size = log(cabs(z)), angle = carg(z);
  return cexp(from(size * __real__ w - angle * __imag__ w, size * __imag__ w + angle * __real__ w));
}

float crealf(float _Complex z) { return __real__ z; }
float cimagf(float _Complex z) { return __imag__ z; }
float cabsf(float _Complex z) { return (float)cabs(z); }
float cargf(float _Complex z) { return (float)carg(z); }
float _Complex conjf(float _Complex z) { return (float _Complex)conj(z); }
float _Complex cexpf(float _Complex z) { return (float _Complex)cexp(z); }
