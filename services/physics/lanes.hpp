/// Vectors of eight doubles, in registers as wide as the instruction set has. Each lane gets the bits that scalar arithmetic
/// would give, whatever the width.
///
/// This header is for sources that are compiled once per instruction set. Everything here has internal linkage, so that the
/// linker cannot mix functions of different instruction sets.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include <cstddef>
#include <cstdint>

#include "services/physics/contact_batch.hpp"

namespace kilotwin::physics {
namespace {

/// A pair of vectors with the operations of one.
template <class T> struct Twice { T a, b; };
using Two = double __attribute__((vector_size(16)));
#if defined(__AVX512F__)
using Four = double __attribute__((vector_size(32)));
using Lanes = double __attribute__((vector_size(64)));
#elif defined(__AVX2__)
using Four = double __attribute__((vector_size(32)));
using Lanes = Twice<Four>;
#else
using Lanes = Twice<Twice<Two>>;
#endif

inline Two larger(Two v, Two w) { return v > w ? v : w; }
inline Two smaller(Two v, Two w) { return v < w ? v : w; }
template <class Mask> inline Two chosen(Mask m, Two v, Two otherwise) { return m ? v : otherwise; }
inline double largest(Two v) { return v[0] > v[1] ? v[0] : v[1]; }
#if defined(__SSE2__)
inline Two root(Two v) { return _mm_sqrt_pd(v); }
#else
inline Two root(Two v) { return Two{__builtin_sqrt(v[0]), __builtin_sqrt(v[1])}; }
#endif

#if defined(__SSE2__)
/// Whether v > w in any lane.
inline bool any_above(Two v, Two w) { return _mm_movemask_pd(_mm_cmpgt_pd(v, w)) != 0; }
#else
inline bool any_above(Two v, Two w) { return v[0] > w[0] || v[1] > w[1]; }
#endif

#if defined(__AVX2__)
inline bool any_above(Four v, Four w) { return _mm256_movemask_pd(_mm256_cmp_pd(v, w, _CMP_GT_OQ)) != 0; }
inline Four larger(Four v, Four w) { return v > w ? v : w; }
inline Four smaller(Four v, Four w) { return v < w ? v : w; }
template <class Mask> inline Four chosen(Mask m, Four v, Four otherwise) { return m ? v : otherwise; }
inline Four root(Four v) { return _mm256_sqrt_pd(v); }
inline double largest(Four v) {
  return largest(larger(__builtin_shufflevector(v, v, 0, 1), __builtin_shufflevector(v, v, 2, 3)));
}
#endif

#if defined(__AVX512F__)
inline bool any_above(Lanes v, Lanes w) { return _mm512_cmp_pd_mask(v, w, _CMP_GT_OQ) != 0; }
inline Lanes larger(Lanes v, Lanes w) { return v > w ? v : w; }
inline Lanes smaller(Lanes v, Lanes w) { return v < w ? v : w; }
template <class Mask> inline Lanes chosen(Mask m, Lanes v, Lanes otherwise) { return m ? v : otherwise; }
inline Lanes root(Lanes v) { return _mm512_maskz_sqrt_pd(0xff, v); }
inline double largest(Lanes v) {
  return largest(larger(__builtin_shufflevector(v, v, 0, 1, 2, 3), __builtin_shufflevector(v, v, 4, 5, 6, 7)));
}
#endif

template <class T> inline Twice<T> operator+(Twice<T> v, Twice<T> w) { return {v.a + w.a, v.b + w.b}; }
template <class T> inline Twice<T> operator-(Twice<T> v, Twice<T> w) { return {v.a - w.a, v.b - w.b}; }
template <class T> inline Twice<T> operator*(Twice<T> v, Twice<T> w) { return {v.a * w.a, v.b * w.b}; }
template <class T> inline Twice<T> operator/(Twice<T> v, Twice<T> w) { return {v.a / w.a, v.b / w.b}; }
template <class T> inline Twice<T> operator-(Twice<T> v) { return {-v.a, -v.b}; }
template <class T> inline auto operator>(Twice<T> v, Twice<T> w) {
  return Twice<decltype(v.a > w.a)>{v.a > w.a, v.b > w.b};
}
template <class Mask> inline Twice<Mask> operator&(Twice<Mask> m, Twice<Mask> n) { return {m.a & n.a, m.b & n.b}; }
template <class Mask, class T> inline Twice<T> chosen(Twice<Mask> m, Twice<T> v, Twice<T> otherwise) {
  return {chosen(m.a, v.a, otherwise.a), chosen(m.b, v.b, otherwise.b)};
}
template <class T> inline Twice<T> larger(Twice<T> v, Twice<T> w) { return {larger(v.a, w.a), larger(v.b, w.b)}; }
template <class T> inline Twice<T> smaller(Twice<T> v, Twice<T> w) {
  return {smaller(v.a, w.a), smaller(v.b, w.b)};
}
template <class T> inline bool any_above(Twice<T> v, Twice<T> w) {
  return any_above(v.a, w.a) || any_above(v.b, w.b);
}
template <class T> inline Twice<T> root(Twice<T> v) { return {root(v.a), root(v.b)}; }
template <class T> inline double largest(Twice<T> v) { return largest(larger(v.a, v.b)); }

inline Lanes load(const double* from) {
  Lanes v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
inline void store(Lanes v, double* to) { __builtin_memcpy(to, &v, sizeof v); }
inline Lanes all(double v) {
  const double eight[kLanes] = {v, v, v, v, v, v, v, v};
  return load(eight);
}
inline Lanes gather(const double* column, const std::uint32_t* at) {
  const double eight[kLanes] = {column[at[0]], column[at[1]], column[at[2]], column[at[3]],
                                column[at[4]], column[at[5]], column[at[6]], column[at[7]]};
  return load(eight);
}

/// The four columns of eight rows of four doubles.
struct Columns {
  Lanes a, b, c, d;
};

template <class V> inline V loaded(const double* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
template <class V> inline void put(V v, double* to) { __builtin_memcpy(to, &v, sizeof v); }

#if defined(__AVX2__)

struct FourColumns {
  Four a, b, c, d;
};
inline FourColumns turned(Four r0, Four r1, Four r2, Four r3) {
  const Four ac01 = __builtin_shufflevector(r0, r1, 0, 4, 2, 6), bd01 = __builtin_shufflevector(r0, r1, 1, 5, 3, 7);
  const Four ac23 = __builtin_shufflevector(r2, r3, 0, 4, 2, 6), bd23 = __builtin_shufflevector(r2, r3, 1, 5, 3, 7);
  return {__builtin_shufflevector(ac01, ac23, 0, 1, 4, 5), __builtin_shufflevector(bd01, bd23, 0, 1, 4, 5),
          __builtin_shufflevector(ac01, ac23, 2, 3, 6, 7), __builtin_shufflevector(bd01, bd23, 2, 3, 6, 7)};
}
inline FourColumns four_rows(const double* table, const std::uint32_t* at) {
  return turned(loaded<Four>(table + 4 * std::size_t{at[0]}), loaded<Four>(table + 4 * std::size_t{at[1]}),
                loaded<Four>(table + 4 * std::size_t{at[2]}), loaded<Four>(table + 4 * std::size_t{at[3]}));
}
inline void put_four_rows(Four a, Four b, Four c, Four d, double* table) {
  const FourColumns rows = turned(a, b, c, d);
  put(rows.a, table);
  put(rows.b, table + 4);
  put(rows.c, table + 8);
  put(rows.d, table + 12);
}

#if defined(__AVX512F__)
/// Gathers the rows at[0..7] of a table with four doubles per row.
inline Columns rows(const double* table, const std::uint32_t* at) {
  const auto pair = [&](std::size_t r, std::size_t s) {
    return Lanes(__builtin_shufflevector(loaded<Four>(table + 4 * std::size_t{at[r]}),
                                         loaded<Four>(table + 4 * std::size_t{at[s]}), 0, 1, 2, 3, 4, 5, 6, 7));
  };
  const Lanes r02 = pair(0, 2), r13 = pair(1, 3), r46 = pair(4, 6), r57 = pair(5, 7);
  const Lanes ac03 = __builtin_shufflevector(r02, r13, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes bd03 = __builtin_shufflevector(r02, r13, 1, 9, 3, 11, 5, 13, 7, 15);
  const Lanes ac47 = __builtin_shufflevector(r46, r57, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes bd47 = __builtin_shufflevector(r46, r57, 1, 9, 3, 11, 5, 13, 7, 15);
  return {__builtin_shufflevector(ac03, ac47, 0, 1, 4, 5, 8, 9, 12, 13),
          __builtin_shufflevector(bd03, bd47, 0, 1, 4, 5, 8, 9, 12, 13),
          __builtin_shufflevector(ac03, ac47, 2, 3, 6, 7, 10, 11, 14, 15),
          __builtin_shufflevector(bd03, bd47, 2, 3, 6, 7, 10, 11, 14, 15)};
}
/// Writes eight consecutive rows of four doubles.
inline void put_rows(const Columns& v, double* table) {
  const Lanes ab_even = __builtin_shufflevector(v.a, v.b, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes ab_odd = __builtin_shufflevector(v.a, v.b, 1, 9, 3, 11, 5, 13, 7, 15);
  const Lanes cd_even = __builtin_shufflevector(v.c, v.d, 0, 8, 2, 10, 4, 12, 6, 14);
  const Lanes cd_odd = __builtin_shufflevector(v.c, v.d, 1, 9, 3, 11, 5, 13, 7, 15);
  const auto put_two = [table](Lanes two, std::size_t r, std::size_t s) {
    put(Four(__builtin_shufflevector(two, two, 0, 1, 2, 3)), table + 4 * r);
    put(Four(__builtin_shufflevector(two, two, 4, 5, 6, 7)), table + 4 * s);
  };
  put_two(__builtin_shufflevector(ab_even, cd_even, 0, 1, 8, 9, 2, 3, 10, 11), 0, 2);
  put_two(__builtin_shufflevector(ab_even, cd_even, 4, 5, 12, 13, 6, 7, 14, 15), 4, 6);
  put_two(__builtin_shufflevector(ab_odd, cd_odd, 0, 1, 8, 9, 2, 3, 10, 11), 1, 3);
  put_two(__builtin_shufflevector(ab_odd, cd_odd, 4, 5, 12, 13, 6, 7, 14, 15), 5, 7);
}
#else
/// Gathers the rows at[0..7] of a table with four doubles per row.
inline Columns rows(const double* table, const std::uint32_t* at) {
  const FourColumns low = four_rows(table, at), high = four_rows(table, at + 4);
  return {{low.a, high.a}, {low.b, high.b}, {low.c, high.c}, {low.d, high.d}};
}
/// Writes eight consecutive rows of four doubles.
inline void put_rows(const Columns& v, double* table) {
  put_four_rows(v.a.a, v.b.a, v.c.a, v.d.a, table);
  put_four_rows(v.a.b, v.b.b, v.c.b, v.d.b, table + 16);
}
#endif

#else

struct TwoColumns {
  Two a, b, c, d;
};
inline TwoColumns two_rows(const double* table, const std::uint32_t* at) {
  const double* const r = table + 4 * std::size_t{at[0]};
  const double* const s = table + 4 * std::size_t{at[1]};
  const Two r0 = loaded<Two>(r), r1 = loaded<Two>(r + 2), s0 = loaded<Two>(s), s1 = loaded<Two>(s + 2);
  return {__builtin_shufflevector(r0, s0, 0, 2), __builtin_shufflevector(r0, s0, 1, 3),
          __builtin_shufflevector(r1, s1, 0, 2), __builtin_shufflevector(r1, s1, 1, 3)};
}
inline void put_two_rows(Two a, Two b, Two c, Two d, double* table) {
  put(Two(__builtin_shufflevector(a, b, 0, 2)), table);
  put(Two(__builtin_shufflevector(c, d, 0, 2)), table + 2);
  put(Two(__builtin_shufflevector(a, b, 1, 3)), table + 4);
  put(Two(__builtin_shufflevector(c, d, 1, 3)), table + 6);
}

/// Gathers the rows at[0..7] of a table with four doubles per row.
inline Columns rows(const double* table, const std::uint32_t* at) {
  const TwoColumns p = two_rows(table, at), q = two_rows(table, at + 2), r = two_rows(table, at + 4),
                   s = two_rows(table, at + 6);
  return {{{p.a, q.a}, {r.a, s.a}}, {{p.b, q.b}, {r.b, s.b}}, {{p.c, q.c}, {r.c, s.c}}, {{p.d, q.d}, {r.d, s.d}}};
}
/// Writes eight consecutive rows of four doubles.
inline void put_rows(const Columns& v, double* table) {
  put_two_rows(v.a.a.a, v.b.a.a, v.c.a.a, v.d.a.a, table);
  put_two_rows(v.a.a.b, v.b.a.b, v.c.a.b, v.d.a.b, table + 8);
  put_two_rows(v.a.b.a, v.b.b.a, v.c.b.a, v.d.b.a, table + 16);
  put_two_rows(v.a.b.b, v.b.b.b, v.c.b.b, v.d.b.b, table + 24);
}

#endif

}  // namespace
}  // namespace kilotwin::physics
