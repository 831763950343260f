/// Eight doubles worked on at a time, by instructions of two each, which every CPU of the family has: enough independent work
/// to keep its units busy. Each lane gets the bits that a double alone would get.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kilotwin::physics {

/// Two of something with the operations of one; Two itself is what one instruction works on.
using Two = double __attribute__((vector_size(16)));
template <class T> struct Twice { T a, b; };
using Four = Twice<Two>;
using Lanes = Twice<Four>;
inline constexpr std::size_t kLanes = 8;

inline Two larger(Two v, Two w) { return v > w ? v : w; }
inline Two smaller(Two v, Two w) { return v < w ? v : w; }
inline Two root(Two v) { return Two{__builtin_sqrt(v[0]), __builtin_sqrt(v[1])}; }
template <class Mask> inline Two chosen(Mask m, Two v, Two otherwise) { return m ? v : otherwise; }
inline double largest(Two v) { return v[0] > v[1] ? v[0] : v[1]; }
inline double smallest(Two v) { return v[0] < v[1] ? v[0] : v[1]; }

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
template <class T> inline Twice<T> root(Twice<T> v) { return {root(v.a), root(v.b)}; }
template <class T> inline double largest(Twice<T> v) { return largest(larger(v.a, v.b)); }
template <class T> inline double smallest(Twice<T> v) { return smallest(smaller(v.a, v.b)); }

inline Lanes all(double v) {
  const Two two = {v, v};
  return {{two, two}, {two, two}};
}
inline Lanes load(const double* from) {
  Lanes v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
inline void store(Lanes v, double* to) { __builtin_memcpy(to, &v, sizeof v); }
inline Lanes gather(const double* column, const std::uint32_t* at) {
  const auto two = [&](std::size_t lane) { return Two{column[at[lane]], column[at[lane + 1]]}; };
  return {{two(0), two(2)}, {two(4), two(6)}};
}

}  // namespace kilotwin::physics
