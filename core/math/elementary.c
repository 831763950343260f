/* Method of all functions: reduce the argument exactly to a small range, and approximate there by a polynomial. A pair
 * (value, rest) carries rounding errors up to the last addition, so the total error is little more than half a unit in the
 * last place. derive_constants.py prints every constant and table. */
#include "elementary.h"

#include <stdint.h>

#include "sine_series.h"

__extension__ typedef unsigned __int128 Wide;

typedef struct {
  double value, rest;
} Pair;

static const double kInfinity = __builtin_inf();
static const Pair kNone = {0, 0};
static const Pair kPi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
static const Pair kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};

/* All functions return this NaN, because the NaN that an operation yields differs between processors. */
static double not_a_number(void) { return __builtin_nan(""); }

static uint64_t bits_of(double x) {
  uint64_t bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  return bits;
}

static double double_of(uint64_t bits) {
  double x;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

static double magnitude(double x) { return __builtin_fabs(x); }
static int is_negative(double x) { return (int)(bits_of(x) >> 63); }
static double with_sign(double x, int negative) { return double_of(bits_of(x) ^ (uint64_t)negative << 63); }

/* 2^n for -1022 <= n <= 1023. */
static double power_of_two(int n) { return double_of((uint64_t)(n + 1023) << 52); }

/* The nearest integer to x, |x| < 2^51. */
static double nearest(double x) { return (x + kWholeNumbers) - kWholeNumbers; }

/* x with the lower 27 bits of its significand cleared; products of two such values are exact. */
static double upper(double x) { return double_of(bits_of(x) & ~(uint64_t)0x7ffffff); }

/* The exact error a * b - product, where product is a * b rounded. */
static double product_rest(double a, double b, double product) {
  const double a_up = upper(a), b_up = upper(b), a_low = a - a_up, b_low = b - b_up;
  return ((a_up * b_up - product) + (a_up * b_low + a_low * b_up)) + a_low * b_low;
}

/* ---- Polynomials: pairs of terms side by side, which shortens the chain of dependent operations. */

static double polynomial5(const double c[5], double x) {
  const double x2 = x * x;
  return (c[0] + c[1] * x) + x2 * ((c[2] + c[3] * x) + x2 * c[4]);
}

static double polynomial6(const double c[6], double x) {
  const double x2 = x * x;
  return (c[0] + c[1] * x) + x2 * ((c[2] + c[3] * x) + x2 * (c[4] + c[5] * x));
}

static double polynomial7(const double c[7], double x) {
  const double x2 = x * x;
  return (c[0] + c[1] * x) + x2 * ((c[2] + c[3] * x) + x2 * ((c[4] + c[5] * x) + x2 * c[6]));
}

static double polynomial8(const double c[8], double x) {
  const double x2 = x * x, x4 = x2 * x2;
  return ((c[0] + c[1] * x) + x2 * (c[2] + c[3] * x)) + x4 * ((c[4] + c[5] * x) + x2 * (c[6] + c[7] * x));
}

/* ---- sin, cos, tan */

/* 2/pi after one word of zeros, 64 bits per word. */
static const uint64_t kTwoOverPi[21] = {0,
                                        0xa2f9836e4e441529u,
                                        0xfc2757d1f534ddc0u,
                                        0xdb6295993c439041u,
                                        0xfe5163abdebbc561u,
                                        0xb7246e3a424dd2e0u,
                                        0x06492eea09d1921cu,
                                        0xfe1deb1cb129a73eu,
                                        0xe88235f52ebb4484u,
                                        0xe99c7026b45f7e41u,
                                        0x3991d639835339f4u,
                                        0x9c845f8bbdf9283bu,
                                        0x1ff897ffde05980fu,
                                        0xef2f118b5a0a6d1fu,
                                        0x6d367ecf27cb09b7u,
                                        0x4f463f669e5fea2du,
                                        0x7527bac7ebe5f17bu,
                                        0x3d0739f78a5292eau,
                                        0x6bfb5fb11f8d5d08u,
                                        0x56033046fc7b6babu,
                                        0xf0cfbc209af4361du};

/* An angle minus `quadrant` right angles; |remainder| <= pi/4. */
typedef struct {
  Pair remainder;
  unsigned quadrant;
} Reduced;

/* For finite |x| >= 1: multiplies x by the 192 relevant bits of 2/pi in integer arithmetic. The bits before them contribute
 * multiples of four right angles, the bits after them less than 2^-137. */
static Reduced reduced_exactly(double x) {
  const uint64_t mantissa = (bits_of(x) & 0xfffffffffffffu) | 0x10000000000000u;
  const int exponent = (int)(bits_of(x) >> 52 & 0x7ff) - 1075;
  const unsigned start = (unsigned)(exponent - 2 + 64), shift = start % 64;
  uint64_t window[3];
  for (unsigned i = 0; i < 3; ++i) {
    const uint64_t* word = kTwoOverPi + start / 64 + i;
    window[i] = shift == 0 ? word[0] : word[0] << shift | word[1] >> (64 - shift);
  }
  /* The product modulo 2^192 as high, middle and low word; 2^190 is one right angle. */
  const Wide last = (Wide)mantissa * window[2];
  const Wide centre = (Wide)mantissa * window[1] + (uint64_t)(last >> 64);
  uint64_t low = (uint64_t)last, middle = (uint64_t)centre, high = mantissa * window[0] + (uint64_t)(centre >> 64);
  unsigned quadrant = (unsigned)((high + ((uint64_t)1 << 61)) >> 62) & 3;
  high -= (uint64_t)quadrant << 62;
  const int below = (int)(high >> 63);
  if (below) {
    low = ~low;
    middle = ~middle;
    high = ~high;
  }
  int zeros = 0;
  if (high == 0) {
    high = middle;
    middle = low;
    low = 0;
    zeros = 64;
  }
  const int lead = __builtin_clzll(high | 1);
  Wide fraction = (Wide)high << 64 | middle;
  if (lead > 0) fraction = fraction << lead | low >> (64 - lead);
  zeros += lead;
  const double value = (double)(int64_t)(uint64_t)(fraction >> 75) * power_of_two(75 - 126 - zeros);
  const double rest =
      (double)(int64_t)(uint64_t)(fraction >> 22 & 0x1fffffffffffffu) * power_of_two(22 - 126 - zeros);
  const double angle = value * kHalfPi.value;
  const double angle_rest =
      product_rest(value, kHalfPi.value, angle) + (value * kHalfPi.rest + rest * kHalfPi.value);
  const int negative = is_negative(x);
  const Reduced result = {{with_sign(angle, negative ^ below), with_sign(angle_rest, negative ^ below)},
                          (negative ? 0u - quadrant : quadrant) & 3};
  return result;
}

/* Reduction for any finite x. */
static Reduced reduced(double x) {
  if (magnitude(x) <= 0x1p20) {
    const double turns = nearest(x * kTwoOverPiRounded);
    const double first = x - turns * kHalfPi1, second = turns * kHalfPi2;
    const double value = first - second;
    const double rest = ((first - value) - second) - turns * kHalfPi3;
    /* Next to a multiple of pi/2, cancellation may be so large that the third part is too short. */
    if (!(magnitude(value) < magnitude(turns) * 0x1p-60)) {
      const double sum = value + rest;
      const Reduced result = {{sum, (value - sum) + rest}, (unsigned)((int)turns & 3)};
      return result;
    }
  }
  return reduced_exactly(x);
}

static Pair sine_of(Pair r) {
  const double z = r.value * r.value;
  const double more = r.value * z * polynomial7(kSine, z) + r.rest * (1 - 0.5 * z);
  const double value = r.value + more;
  const Pair result = {value, (r.value - value) + more};
  return result;
}

static Pair cosine_of(Pair r) {
  const double z = r.value * r.value, half = 0.5 * z, first = 1 - half;
  const double more = ((1 - first) - half) + (z * z * polynomial6(kCosine, z) - r.value * r.rest);
  const double value = first + more;
  const Pair result = {value, (first - value) + more};
  return result;
}

void kt_sincos(double x, double* s, double* c) {
  if (magnitude(x) < 0x1p-27) {
    *s = x;
    *c = 1;
  } else if (magnitude(x) < kInfinity) {
    const Reduced r = reduced(x);
    const uint64_t sine = bits_of(sine_of(r.remainder).value), cosine = bits_of(cosine_of(r.remainder).value);
    const uint64_t exchange = (sine ^ cosine) & (0u - (uint64_t)(r.quadrant & 1));
    *s = double_of(sine ^ exchange ^ (uint64_t)(r.quadrant >> 1) << 63);
    *c = double_of(cosine ^ exchange ^ (uint64_t)((r.quadrant ^ r.quadrant >> 1) & 1) << 63);
  } else {
    *s = *c = not_a_number();
  }
}

double kt_sin(double x) {
  double s, c;
  kt_sincos(x, &s, &c);
  return s;
}

double kt_cos(double x) {
  double s, c;
  kt_sincos(x, &s, &c);
  return c;
}

double kt_tan(double x) {
  if (magnitude(x) < 0x1p-27) return x;
  if (!(magnitude(x) < kInfinity)) return not_a_number();
  const Reduced r = reduced(x);
  const Pair s = sine_of(r.remainder), c = cosine_of(r.remainder);
  const int odd = (int)(r.quadrant & 1);
  const Pair top = odd ? c : s, bottom = odd ? s : c;
  const double ratio = top.value / bottom.value, product = ratio * bottom.value;
  const double missing =
      (top.value - product) - product_rest(ratio, bottom.value, product) + (top.rest - ratio * bottom.rest);
  return with_sign(ratio + missing / bottom.value, odd);
}

/* ---- atan, atan2, asin, acos */

/* (atan u - u) / u^3 in powers of u^2, |u| <= 1/16. */
static const double kArc[6] = {-0x1.5555555555555p-2, 0x1.999999999994ep-3,  -0x1.249249245ad84p-3,
                               0x1.c71c6fedc5733p-4,  -0x1.745985823fac1p-4, 0x1.37e5c2335d231p-4};

/* atan(i/32). */
static const Pair kArcTable[33] = {
    {0, 0},
    {0x1.ffd55bba97625p-6, -0x1.5ec431444912cp-60},
    {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
    {0x1.7ee182602f10fp-4, -0x1.cfb654c0c3d98p-58},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.3d6eee8c6626cp-3, 0x1.61a3b0ce9281bp-57},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
    {0x1.b90d7529260a2p-3, 0x1.17b10d2e0e5abp-61},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.18bf5a30bf178p-2, 0x1.30ca4748b1bf9p-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
    {0x1.530ad9951cd4ap-2, -0x1.2566480884082p-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.8b24d394a1b25p-2, 0x1.b6d0ba3748fa8p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
    {0x1.c0db4c94ec9fp-2, -0x1.cc1ce70934c34p-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.f40dd0b541418p-2, -0x1.a3992dc382a23p-57},
    {0x1.0657e94db30dp-1, -0x1.d5b495f6349e6p-56},
    {0x1.1255d9bfbd2a9p-1, -0x1.2bdaee1c0ee35p-58},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.2958e59308e31p-1, -0x1.09e73b0c6c087p-56},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
    {0x1.3f13fb89e96f4p-1, 0x1.ecf8b492644fp-56},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.538f57b89061fp-1, -0x1.1bb74abda520cp-55},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
    {0x1.66d663923e087p-1, -0x1.6ea6febe8bbbap-56},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.78f6bbd5d315ep-1, 0x1.406a08980374p-55},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
    {0x1.89ff5ff57f1f8p-1, -0x1.55b9a5e177a1bp-55},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

/* The angle of the point (x, y), or of (-x, y) if `left`, from the x axis, in [0, pi]. x, y >= 0, not both infinite. */
static double angle_of(Pair y, Pair x, int left) {
  const int steep = y.value > x.value;
  Pair top = steep ? x : y, bottom = steep ? y : x;
  Pair arc = kNone;
  if (top.value < bottom.value * 0x1p-60) {
    arc.value = top.value / bottom.value;
  } else if (bottom.value != 0) {
    if (bottom.value > 0x1p500 || bottom.value < 0x1p-500) {
      const double scale = bottom.value > 1 ? 0x1p-600 : 0x1p600;
      top.value *= scale;
      bottom.value *= scale; /* The rests are 0: only sides up to 1 and of usual magnitude have any. */
    }
    const double inverse = 1 / bottom.value;
    const double ratio = top.value / bottom.value, product = ratio * bottom.value;
    const double ratio_rest =
        (((top.value - product) - product_rest(ratio, bottom.value, product)) + (top.rest - ratio * bottom.rest)) *
        inverse;
    if (ratio < 0x1p-4) {
      const double z = ratio * ratio;
      arc.value = ratio;
      arc.rest = ratio_rest * (1 - z) + ratio * z * polynomial6(kArc, z);
    } else {
      const double node = nearest(ratio * 32) * 0x1p-5;
      const Pair* known = kArcTable + (int)(node * 32);
      const double u = ((ratio - node) + ratio_rest) / (1 + ratio * node), z = u * u;
      arc.value = known->value + u;
      arc.rest = ((known->value - arc.value) + u) + (known->rest + u * z * polynomial6(kArc, z));
    }
  }
  const Pair base = steep ? kHalfPi : left ? kPi : kNone;
  const double value = with_sign(arc.value, left != steep), rest = with_sign(arc.rest, left != steep);
  const double sum = base.value + value;
  return sum + (((base.value - sum) + value) + (base.rest + rest));
}

double kt_atan2(double y, double x) {
  if (x != x || y != y) return not_a_number();
  Pair up = {magnitude(y), 0}, along = {magnitude(x), 0};
  if (up.value == kInfinity || along.value == kInfinity) {
    const int both = up.value == along.value;
    const double side = up.value == kInfinity;
    along.value = both ? 1 : 1 - side;
    up.value = side;
  }
  return with_sign(angle_of(up, along, is_negative(x)), is_negative(y));
}

double kt_atan(double x) { return kt_atan2(x, 1); }

/* sqrt(1 - x^2) for |x| <= 1. */
static Pair other_leg(double x) {
  const double square = x * x;
  const double difference = 1 - square, difference_rest = ((1 - difference) - square) - product_rest(x, x, square);
  const double w = difference + difference_rest, w_rest = (difference - w) + difference_rest;
  const double root = __builtin_sqrt(w), root_square = root * root;
  Pair result = {root, 0};
  if (w > 0) result.rest = (((w - root_square) - product_rest(root, root, root_square)) + w_rest) / (2 * root);
  return result;
}

double kt_asin(double x) {
  if (!(magnitude(x) <= 1)) return not_a_number();
  const Pair opposite = {magnitude(x), 0};
  return with_sign(angle_of(opposite, other_leg(x), 0), is_negative(x));
}

double kt_acos(double x) {
  if (!(magnitude(x) <= 1)) return not_a_number();
  const Pair adjacent = {magnitude(x), 0};
  return angle_of(other_leg(x), adjacent, is_negative(x));
}

/* ---- exp, log, pow */

/* (e^r - 1 - r) / r^2, |r| <= ln2/64. */
static const double kExponential[5] = {0x1p-1, 0x1.555555554dccap-3, 0x1.555555555191p-5, 0x1.11114faa79fd2p-7,
                                       0x1.6c1700057e56ap-10};

/* 2^(i/32). */
static const Pair kExponentialTable[32] = {
    {0x1p+0, 0},
    {0x1.059b0d3158574p+0, 0x1.d73e2a475b465p-55},
    {0x1.0b5586cf9890fp+0, 0x1.8a62e4adc610bp-54},
    {0x1.11301d0125b51p+0, -0x1.6c51039449b3ap-54},
    {0x1.172b83c7d517bp+0, -0x1.19041b9d78a76p-55},
    {0x1.1d4873168b9aap+0, 0x1.e016e00a2643cp-54},
    {0x1.2387a6e756238p+0, 0x1.9b07eb6c70573p-54},
    {0x1.29e9df51fdee1p+0, 0x1.612e8afad1255p-55},
    {0x1.306fe0a31b715p+0, 0x1.6f46ad23182e4p-55},
    {0x1.371a7373aa9cbp+0, -0x1.63aeabf42eae2p-54},
    {0x1.3dea64c123422p+0, 0x1.ada0911f09ebcp-55},
    {0x1.44e086061892dp+0, 0x1.89b7a04ef80dp-59},
    {0x1.4bfdad5362a27p+0, 0x1.d4397afec42e2p-56},
    {0x1.5342b569d4f82p+0, -0x1.07abe1db13cadp-55},
    {0x1.5ab07dd485429p+0, 0x1.6324c054647adp-54},
    {0x1.6247eb03a5585p+0, -0x1.383c17e40b497p-54},
    {0x1.6a09e667f3bcdp+0, -0x1.bdd3413b26456p-54},
    {0x1.71f75e8ec5f74p+0, -0x1.16e4786887a99p-55},
    {0x1.7a11473eb0187p+0, -0x1.41577ee04992fp-55},
    {0x1.82589994cce13p+0, -0x1.d4c1dd41532d8p-54},
    {0x1.8ace5422aa0dbp+0, 0x1.6e9f156864b27p-54},
    {0x1.93737b0cdc5e5p+0, -0x1.75fc781b57ebcp-57},
    {0x1.9c49182a3f09p+0, 0x1.c7c46b071f2bep-56},
    {0x1.a5503b23e255dp+0, -0x1.d2f6edb8d41e1p-54},
    {0x1.ae89f995ad3adp+0, 0x1.7a1cd345dcc81p-54},
    {0x1.b7f76f2fb5e47p+0, -0x1.5584f7e54ac3bp-56},
    {0x1.c199bdd85529cp+0, 0x1.11065895048ddp-55},
    {0x1.cb720dcef9069p+0, 0x1.503cbd1e949dbp-56},
    {0x1.d5818dcfba487p+0, 0x1.2ed02d75b3707p-55},
    {0x1.dfc97337b9b5fp+0, -0x1.1a5cd4f184b5cp-54},
    {0x1.ea4afa2a490dap+0, -0x1.e9c23179c2893p-54},
    {0x1.f50765b6e454p+0, 0x1.9d3e12dd8a18bp-54},
};

/* e^(x.value + x.rest), |x.value| < 800. */
static double exponential(Pair x) {
  /* ln2/32 in parts of 36 and 53 bits. */
  const double steps = nearest(x.value * 0x1.71547652b82fep+5);
  const double r = ((x.value - steps * 0x1.62e42fefap-6) - steps * 0x1.cf79abc9e3b3ap-45) + x.rest;
  const int count = (int)steps, index = count & 31, exponent = (count - index) / 32;
  const Pair* base = kExponentialTable + index;
  const double value = base->value + (base->rest + base->value * (r + r * r * polynomial5(kExponential, r)));
  if (exponent >= -1020 && exponent <= 1022) return value * power_of_two(exponent);
  const int half = exponent / 2;
  return value * power_of_two(half) * power_of_two(exponent - half);
}

double kt_exp(double x) {
  if (x > 710) return kInfinity;
  if (x < -746) return 0;
  if (x != x) return not_a_number();
  const Pair exact = {x, 0};
  return exponential(exact);
}

/* (log(1 + r) - r + r^2/2) / r^3, |r| <= 1/64. */
static const double kLogarithm[8] = {0x1.5555555555555p-2, -0x1p-2,
                                     0x1.999999999c82ap-3, -0x1.5555555558005p-3,
                                     0x1.2492483bc1f1ap-3, -0x1.fffffe552c2ddp-4,
                                     0x1.c74b00ccb2ce3p-4, -0x1.99c447690a909p-4};

/* ln2 rounded to a multiple of 2^-42, and the rest. */
static const Pair kLn2 = {0x1.62e42fefa38p-1, 0x1.ef35793c7673p-45};

/* For significands in [1 + j/64, 1 + (j+1)/64): c, close to the reciprocal, a multiple of 2^-9; then -log c, minus ln2 for
 * j >= 27 (sqrt 2), rounded to a multiple of 2^-42; then the rest. c = 1 on both sides of 1, where the logarithm is small. */
static const struct {
  double c, value, rest;
} kLogarithmTable[64] = {
    {0x1p+0, 0, 0},
    {0x1.f4p-1, 0x1.8492528c9p-6, -0x1.aa0ba325a0c34p-45},
    {0x1.edp-1, 0x1.35c8bfaa1p-5, 0x1.8357d5ef9eb35p-44},
    {0x1.e5p-1, 0x1.bbcebfc69p-5, -0x1.7bf868c317c2ap-46},
    {0x1.dep-1, 0x1.1973bd1464p-4, 0x1.566d154f930b3p-44},
    {0x1.d7p-1, 0x1.55e10050ep-4, 0x1.c1d740c53c72ep-47},
    {0x1.d1p-1, 0x1.8a6477a91cp-4, 0x1.c28c0af9bd6dfp-44},
    {0x1.cap-1, 0x1.c885801bc4p-4, 0x1.646d1c65aacd3p-45},
    {0x1.c4p-1, 0x1.fe89139dbcp-4, 0x1.56594d82f7a82p-44},
    {0x1.bep-1, 0x1.1aa2b7e24p-3, -0x1.1ac38dde3b366p-44},
    {0x1.b8p-1, 0x1.365fcb015ap-3, -0x1.fd3a0afb9691bp-44},
    {0x1.b2p-1, 0x1.527e5e4a1cp-3, -0x1.4e60b8d4b411dp-44},
    {0x1.acp-1, 0x1.6f0128b756p-3, 0x1.577390d31ef0fp-44},
    {0x1.a7p-1, 0x1.871213750ep-3, 0x1.328eb42f9af75p-44},
    {0x1.a1p-1, 0x1.a454082e6ap-3, 0x1.60a77c81f7171p-44},
    {0x1.9cp-1, 0x1.bd087383bep-3, -0x1.d4bc4595412b6p-45},
    {0x1.97p-1, 0x1.d60a17f904p-3, -0x1.5d6e06fc20d39p-44},
    {0x1.92p-1, 0x1.ef5ade4ddp-3, -0x1.a211565bb8e11p-51},
    {0x1.8dp-1, 0x1.047e60cde8p-2, 0x1.dbdf10d397f3cp-45},
    {0x1.88p-1, 0x1.1178e8227ep-2, 0x1.1ef78ce2d07f2p-44},
    {0x1.84p-1, 0x1.1bf99635a7p-2, -0x1.1ac89575c2125p-44},
    {0x1.7fp-1, 0x1.2941afb187p-2, -0x1.210c2b730e28bp-44},
    {0x1.7bp-1, 0x1.3401e12aedp-2, -0x1.17c73556e291dp-44},
    {0x1.76p-1, 0x1.419b423d5fp-2, -0x1.ce379226de3ecp-44},
    {0x1.72p-1, 0x1.4c9e09e173p-2, -0x1.e20891b0ad8a4p-45},
    {0x1.6ep-1, 0x1.57bf753c8dp-2, 0x1.fadedee5d40efp-46},
    {0x1.6ap-1, 0x1.630030b3abp-2, -0x1.db623e731aep-45},
    {0x1.66p-1, -0x1.5767717456p-2, 0x1.64ead9524d7cap-44},
    {0x1.62p-1, -0x1.4be5f95778p-2, 0x1.d7c92cd9ad824p-44},
    {0x1.5ep-1, -0x1.404308686ap-2, -0x1.f8ef43049f7d3p-44},
    {0x1.5bp-1, -0x1.3772662bfep-2, 0x1.e9436ac53b023p-44},
    {0x1.57p-1, -0x1.2b9303ab8ap-2, 0x1.6db12d6bfb0a5p-45},
    {0x1.54p-1, -0x1.22941fbcf8p-2, 0x1.a6976f5eb0963p-44},
    {0x1.5p-1, -0x1.1675cababap-2, -0x1.8380e731f55c4p-44},
    {0x1.4dp-1, -0x1.0d46b579abp-2, -0x1.d2c81f640e1e6p-44},
    {0x1.49p-1, -0x1.00e6c45ad5p-2, -0x1.cc68d52e01203p-50},
    {0x1.46p-1, -0x1.ef0adcbdc6p-3, 0x1.b26b79c86af24p-45},
    {0x1.43p-1, -0x1.dc1bca0abep-3, -0x1.8fac1a628ccc6p-44},
    {0x1.4p-1, -0x1.c8ff7c79aap-3, 0x1.7794f689f8434p-45},
    {0x1.3dp-1, -0x1.b5b519e8fcp-3, 0x1.4b722ec011f31p-44},
    {0x1.3ap-1, -0x1.a23bc1fe2cp-3, 0x1.539cd91dc9f0bp-44},
    {0x1.37p-1, -0x1.8e928de886p-3, -0x1.a8154b13d72d5p-44},
    {0x1.34p-1, -0x1.7ab890210ep-3, 0x1.bdb9072534a58p-45},
    {0x1.31p-1, -0x1.66acd4272ap-3, -0x1.aa1bdbfc6c785p-44},
    {0x1.2ep-1, -0x1.526e5e3a1cp-3, 0x1.790ba37fc5238p-44},
    {0x1.2bp-1, -0x1.3dfc2b0eccp-3, -0x1.8a72a62b8c13fp-45},
    {0x1.29p-1, -0x1.303d718e48p-3, 0x1.680b5ce3ecb05p-50},
    {0x1.26p-1, -0x1.1b72ad52f6p-3, -0x1.e80a41811a396p-45},
    {0x1.23p-1, -0x1.0671512ca6p-3, 0x1.a47579cdc0a3dp-45},
    {0x1.21p-1, -0x1.f0a30c0118p-4, 0x1.d599e83368e91p-44},
    {0x1.1ep-1, -0x1.c5e548f5bcp-4, -0x1.d0c57585fbe06p-46},
    {0x1.1cp-1, -0x1.a926d3a4acp-4, -0x1.563650bd22a9cp-44},
    {0x1.19p-1, -0x1.7da766d7bp-4, -0x1.2cc844480c89bp-44},
    {0x1.17p-1, -0x1.60658a9374p-4, -0x1.0c3b1dee9c4f8p-44},
    {0x1.15p-1, -0x1.42edcbea64p-4, -0x1.bc0eeea7c9acdp-46},
    {0x1.12p-1, -0x1.16536eea38p-4, 0x1.47c5e768fa309p-46},
    {0x1.1p-1, -0x1.f0a30c0118p-5, 0x1.d599e83368e91p-45},
    {0x1.0ep-1, -0x1.b42dd71198p-5, 0x1.c827ae5d6704cp-46},
    {0x1.0bp-1, -0x1.58a5bafc9p-5, 0x1.b2b739570ad39p-45},
    {0x1.09p-1, -0x1.1b0d98924p-5, 0x1.3401e9ae889bbp-44},
    {0x1.07p-1, -0x1.b9fc027bp-6, 0x1.b9a010ae6922ap-44},
    {0x1.05p-1, -0x1.3cea44347p-6, 0x1.6a2c432d6a40bp-44},
    {0x1.03p-1, -0x1.7dc475f82p-7, 0x1.eb1245b5da1f5p-44},
    {0x1p-1, 0, 0},
};

/* log x for finite x > 0; the relative error is below 2^-65. */
static Pair logarithm(double x) {
  int exponent = -1023;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    exponent -= 54;
  }
  const uint64_t bits = bits_of(x);
  const unsigned j = (unsigned)(bits >> 46) & 63;
  exponent += (int)(bits >> 52) + (j >= 27);
  /* r = m c - 1 without error: the upper 44 bits of m times the 9 bits of c, then the lower ones. */
  const double m = double_of((bits & 0xfffffffffffffu) | 0x3ff0000000000000u);
  const double m_up = double_of(bits_of(m) & ~(uint64_t)0x1ff), c = kLogarithmTable[j].c;
  const double r_up = m_up * c - 1, r_low = (m - m_up) * c;
  const double r = r_up + r_low, r_rest = (r_up - r) + r_low;
  const double square = r * r, half = 0.5 * square, half_rest = 0.5 * product_rest(r, r, square);
  const double base = (double)exponent * kLn2.value + kLogarithmTable[j].value; /* Exact. */
  const double first = base + r, second = first - half;
  const double rest =
      ((((base - first) + r) + ((first - second) - half)) - half_rest + r_rest * (1 - r)) +
      (((double)exponent * kLn2.rest + kLogarithmTable[j].rest) + r * square * polynomial8(kLogarithm, r));
  const double value = second + rest;
  const Pair result = {value, (second - value) + rest};
  return result;
}

double kt_log(double x) {
  if (x > 0 && x < kInfinity) return logarithm(x).value;
  if (x == 0) return -kInfinity;
  return x > 0 ? kInfinity : not_a_number();
}

double kt_pow(double x, double y) {
  if (y == 0 || x == 1) return 1;
  if (x != x || y != y) return not_a_number();
  const double size = magnitude(x);
  if (magnitude(y) == kInfinity) return size == 1 ? 1 : (size > 1) == (y > 0) ? kInfinity : 0;
  const int whole = kt_floor(y) == y, odd = whole && magnitude(y) < 0x1p53 && kt_floor(y / 2) * 2 != y;
  const int negative = is_negative(x) && odd;
  if (size == 0 || size == kInfinity) return with_sign((size == 0) == (y > 0) ? 0 : kInfinity, negative);
  if (is_negative(x) && !whole) return not_a_number();
  const Pair l = logarithm(size);
  const double product = y * l.value;
  if (product > 710) return with_sign(kInfinity, negative);
  if (product < -746) return with_sign(0, negative);
  const Pair exponent = {product, product_rest(y, l.value, product) + y * l.rest};
  return with_sign(exponential(exponent), negative);
}

/* ---- floor, fmod, hypot */

double kt_floor(double x) {
  if (x != x) return not_a_number();
  if (!(magnitude(x) < 0x1p52)) return x;
  double whole = (double)(int64_t)x;
  if (whole > x) whole -= 1;
  return whole == 0 ? 0 * x : whole; /* Keeps the sign of zero. */
}

/* x = mantissa 2^exponent, x > 0 and finite. */
static uint64_t mantissa_of(double x, int* exponent) {
  const int field = (int)(bits_of(x) >> 52);
  const uint64_t fraction = bits_of(x) & 0xfffffffffffffu;
  *exponent = (field == 0 ? 1 : field) - 1075;
  return field == 0 ? fraction : fraction | 0x10000000000000u;
}

double kt_fmod(double x, double y) {
  const double size = magnitude(x), divisor = magnitude(y);
  if (!(size < kInfinity) || divisor == 0 || divisor != divisor) return not_a_number();
  if (size < divisor) return x;
  int exponent, divisor_exponent;
  uint64_t mantissa = mantissa_of(size, &exponent);
  const uint64_t divisor_mantissa = mantissa_of(divisor, &divisor_exponent);
  /* Long division, eleven binary digits at a time: 53 + 11 bits fit into a word. */
  int digits = exponent - divisor_exponent;
  mantissa %= divisor_mantissa;
  while (digits > 0 && mantissa != 0) {
    const int now = digits < 11 ? digits : 11;
    mantissa = (mantissa << now) % divisor_mantissa;
    digits -= now;
  }
  /* mantissa 2^divisor_exponent is a double; the power alone may not be, so it is applied in two factors. */
  const int half = divisor_exponent / 2;
  const double result = (double)(int64_t)mantissa * power_of_two(half) * power_of_two(divisor_exponent - half);
  return with_sign(result, is_negative(x));
}

double kt_hypot(double x, double y) {
  double a = magnitude(x), b = magnitude(y), scale = 1;
  if (a == kInfinity || b == kInfinity) return kInfinity;
  if (a != a || b != b) return not_a_number();
  if (a > 0x1p500 || b > 0x1p500)
    scale = 0x1p600;
  else if (a < 0x1p-450 && b < 0x1p-450)
    scale = 0x1p-600;
  if (scale != 1) {
    a /= scale;
    b /= scale;
  }
  return __builtin_sqrt(a * a + b * b) * scale;
}

/* ---- The quantile of the standard normal distribution: quotients of two polynomials. */

static const double kNormalCentre[2][8] = {/* Quantile over q = p - 1/2, in (27/64)^2 - q^2. */
                                           {0x1.ae2b8f3437073p+1, 0x1.0001e524e6f83p+7, 0x1.cbc9036af3358p+10,
                                            0x1.850d0e62ef925p+13, 0x1.3cd3da400d27cp+15, 0x1.c54245b5378abp+15,
                                            0x1.b96d205cf9f69p+14, 0x1.049a962d767e4p+11},
                                           {0x1p+0, 0x1.4807d6b673072p+5, 0x1.4311f48a0c5b4p+9,
                                            0x1.341664ae92899p+12, 0x1.26ff6f3b516a8p+14, 0x1.0ada56835d5dbp+15,
                                            0x1.7e04ba984fc2ap+14, 0x1.11311035865d5p+12}};
static const double kNormalTail[2][8] = {/* In r - 3/2, r = sqrt(-log(tail probability)) in [1.59, 4.5]. */
                                         {0x1.4059f9ed6652ep+0, 0x1.179c9f24d6927p+2, 0x1.6ccee60110697p+2,
                                          0x1.dbf7999a9e8bfp+1, 0x1.53301b3e9ae76p+0, 0x1.07abd13210a45p-2,
                                          0x1.96f51f9956cf7p-6, 0x1.cc3837e37b504p-11},
                                         {0x1p+0, 0x1.0d817d529c3c8p+1, 0x1.c01a9b0efc85bp+0, 0x1.7599561bbc195p-1,
                                          0x1.451f8e701c028p-3, 0x1.10a3d998e98d2p-6, 0x1.455d1af56599dp-11,
                                          0x1.818901d1a0b3p-30}};
static const double kNormalFarTail[2][8] = {/* In r - 9/2, r in [4.5, 27.3]. */
                                            {0x1.7ae8ca1b3a317p+2, 0x1.53c351a391e19p+2, 0x1.e1bccc9998a53p+0,
                                             0x1.58b3d36adf3ap-2, 0x1.0729f4c49830fp-5, 0x1.a0113e8777eaap-10,
                                             0x1.2e7f12dcdd435p-15, 0x1.269c520c0d25fp-22},
                                            {0x1p+0, 0x1.4b1bed316205bp-1, 0x1.43bdd9dc158cap-3,
                                             0x1.2a9b2e0a6db78p-6, 0x1.095455654424ep-10, 0x1.9d27ad10ebea9p-16,
                                             0x1.a0a3bc887a27dp-23, 0x1.904819e75e4ebp-49}};

static double quotient(const double c[2][8], double x) { return polynomial8(c[0], x) / polynomial8(c[1], x); }

double kt_inverse_normal(double p) {
  const double q = p - 0.5;
  if (magnitude(q) <= 0x1.bp-2) return q * quotient(kNormalCentre, 0x1.6c8p-3 - q * q);
  const double tail = q < 0 ? p : 1 - p;
  if (!(tail > 0)) return tail == 0 ? with_sign(kInfinity, q < 0) : not_a_number();
  const double r = __builtin_sqrt(-logarithm(tail).value);
  return with_sign(r <= 4.5 ? quotient(kNormalTail, r - 1.5) : quotient(kNormalFarTail, r - 4.5), q < 0);
}
