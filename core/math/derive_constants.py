#!/usr/bin/env python3
"""Prints the constants of elementary.c. Needs python3-mpmath. The build does not run it; it documents the constants' origin.

Polynomials interpolate the function at Chebyshev points of the range, which is within a small factor of the best
approximation. Rational functions are minimax approximations. The error printed with each is the largest one found on a
dense grid, with coefficients rounded to double.
"""
from mpmath import mp, mpf, matrix, lu_solve, cos, pi, sqrt, log, exp, atan, sin, erfinv, floor, nint, frexp, ldexp

mp.prec = 400


def rounded(x, bits=53):
    """x rounded to so many significant bits."""
    if x == 0:
        return mpf(0)
    mantissa, exponent = frexp(x)
    return ldexp(nint(ldexp(mantissa, bits)), exponent - bits)


def hexadecimal(x):
    return float(x).hex() if x != 0 else "0.0"


def nodes(low, high, count):
    return [(low + high) / 2 + (high - low) / 2 * cos(pi * (2 * i + 1) / (2 * count)) for i in range(count)]


def show(name, coefficients, error):
    print(f"/* {name}: relative error 2^{float(mp.log(error, 2)):.1f} */")
    print(", ".join(hexadecimal(c) for c in coefficients))


def polynomial(name, f, low, high, count, weight):
    """f ~ sum c[i] x^i; the error is weighted: weight(x) * (approximation - f(x))."""
    points = nodes(mpf(low), mpf(high), count)
    c = lu_solve(matrix([[x**i for i in range(count)] for x in points]), matrix([f(x) for x in points]))
    c = [rounded(v) for v in c]
    grid = nodes(mpf(low), mpf(high), 401)
    error = max(abs(weight(x) * (sum(c[i] * x**i for i in range(count)) - f(x))) for x in grid)
    show(name, c, error)


def quotient(a, b, x):
    """sum a[i] x^i / (1 + sum b[i] x^(i+1))"""
    return mp.polyval(a[::-1], x) / mp.polyval(([mpf(1)] + list(b))[::-1], x)


def rational(name, f, low, high, top, bottom):
    """f ~ quotient, of least relative error: Remez exchange; `low` is the end near which f has its singularity."""
    low, high, count = mpf(low), mpf(high), top + bottom + 2
    grid = sorted({low + (high - low) * (1 - cos(pi * i / 1600)) / 2 for i in range(1601)}
                  | {low + (high - low) * mpf(2)**(-mpf(i) / 16) for i in range(300)})
    values = {x: f(x) for x in grid}
    start = [low + (high - low) * ((1 - cos(pi * i / (count - 1))) / 2)**mpf("1.5") for i in range(count)]
    reference = [min(grid, key=lambda x: abs(x - at)) for at in start]
    b = [mpf(0)] * bottom
    for _ in range(20):
        for _ in range(12):  # the levelled error enters as error * f * denominator: iterate over the denominator
            rows = [[x**j for j in range(top + 1)] + [-values[x] * x**(j + 1) for j in range(bottom)]
                    + [-(-1)**i * values[x] * mp.polyval(([mpf(1)] + b)[::-1], x)] for i, x in enumerate(reference)]
            s = lu_solve(matrix(rows), matrix([values[x] for x in reference]))
            a, b = [s[j] for j in range(top + 1)], [s[top + 1 + j] for j in range(bottom)]
            level = abs(s[top + bottom + 1])
        errors = [quotient(a, b, x) / values[x] - 1 for x in grid]
        peaks, first = [], 0
        for i in range(1, len(grid) + 1):
            if i == len(grid) or mp.sign(errors[i]) != mp.sign(errors[first]):
                peaks.append(max(range(first, i), key=lambda j: abs(errors[j])))
                first = i
        assert len(peaks) >= count, f"{name}: the error has too few extrema"
        while len(peaks) > count:
            peaks.pop(0 if abs(errors[peaks[0]]) < abs(errors[peaks[-1]]) else -1)
        reference = [grid[i] for i in peaks]
        if max(abs(e) for e in errors) < level * mpf("1.01"):
            break
    a, b = [rounded(v) for v in a], [rounded(v) for v in b]
    show(name + ", numerator then denominator", a, max(abs(quotient(a, b, x) / values[x] - 1) for x in grid))
    print(", ".join(hexadecimal(v) for v in [mpf(1)] + b))


def series(f, at_zero):
    """f, with its limit at 0."""
    return lambda x: f(x) if abs(x) > mpf(10)**-30 else at_zero


print("/* 2/pi, 64 bits a word, after one word of zeros */")
mp.prec = 1600
two_over_pi = int(floor(2 / mp.pi * mpf(2)**1280))
print("0, " + ", ".join(f"0x{(two_over_pi >> (1280 - 64 * (i + 1))) & (2**64 - 1):016x}u" for i in range(20)))
mp.prec = 400

print("/* pi/2 in parts of 33, 33, 53 bits; then in 53 + 53; pi in 53 + 53 */")
p1 = rounded(floor(pi / 2 * 2**32) / 2**32)
p2 = rounded(floor((pi / 2 - p1) * mpf(2)**65) / mpf(2)**65)
p3 = rounded(pi / 2 - p1 - p2)
print(*(hexadecimal(p) for p in (p1, p2, p3)))
print(hexadecimal(rounded(pi / 2)), hexadecimal(rounded(pi / 2 - rounded(pi / 2))))
print(hexadecimal(rounded(pi)), hexadecimal(rounded(pi - rounded(pi))))

quarter = (pi / 4 * mpf("1.001"))**2
polynomial("sin: (sin(sqrt z)/sqrt z - 1)/z", lambda z: (sin(sqrt(z)) / sqrt(z) - 1) / z, 0, quarter, 7, lambda z: z)
polynomial("cos: (cos(sqrt z) - 1 + z/2)/z^2", lambda z: (cos(sqrt(z)) - 1 + z / 2) / z**2, 0, quarter, 6,
           lambda z: z**2 / cos(sqrt(z)))
polynomial("atan: (atan(sqrt z)/sqrt z - 1)/z", lambda z: (atan(sqrt(z)) / sqrt(z) - 1) / z, 0, mpf(1) / 256, 6,
           lambda z: z)

print("/* atan(i/32), i = 0..32: value, rest */")
for i in range(33):
    value = atan(mpf(i) / 32)
    rest = rounded(value - rounded(value))
    print(f"{{{hexadecimal(rounded(value))}, {hexadecimal(rest)}}},", end="\n" if i % 2 else " ")
print()

width = log(2) / 64 * mpf("1.001")
polynomial("exp: (e^r - 1 - r)/r^2", series(lambda r: (exp(r) - 1 - r) / r**2, mpf(1) / 2),
           -width, width, 5, lambda r: r**2)
step = log(2) / 32
step_high = rounded(step, 36)
print("/* ln2/32 in parts of 36 and 53 bits, and its reciprocal */")
print(hexadecimal(step_high), hexadecimal(rounded(step - step_high)), hexadecimal(rounded(1 / step)))
print("/* 2^(i/32): value, rest */")
for i in range(32):
    value = mpf(2)**(mpf(i) / 32)
    rest = rounded(value - rounded(value))
    print(f"{{{hexadecimal(rounded(value))}, {hexadecimal(rest)}}},", end="\n" if i % 2 else " ")

polynomial("log: (log(1+r) - r + r^2/2)/r^3", series(lambda r: (log(1 + r) - r + r**2 / 2) / r**3, mpf(1) / 3),
           mpf(-1) / 64, mpf(1) / 64, 8, lambda r: r**2)
ln2_high = floor(log(2) * 2**42) / 2**42
print("/* ln2 to a multiple of 2^-42, and the rest */")
print(hexadecimal(ln2_high), hexadecimal(rounded(log(2) - ln2_high)))
print("/* For mantissas in [1 + j/64, 1 + (j+1)/64): c, about the reciprocal, a multiple of 2^-9; "
      "-log c (less ln2 from j = 27 on) to a multiple of 2^-42; the rest */")
for j in range(64):
    c = mpf(1) if j == 0 else mpf(1) / 2 if j == 63 else nint(512 / (1 + (j + mpf(1) / 2) / 64)) / 512
    value = -log(c) - (log(2) if j >= 27 else 0)
    if c in (1, mpf(1) / 2):
        value = mpf(0)
    high = nint(value * 2**42) / 2**42
    for m in (1 + mpf(j) / 64, 1 + mpf(j + 1) / 64):
        assert abs(m * c - 1) <= mpf(1) / 64
    print(f"{{{hexadecimal(c)}, {hexadecimal(high)}, {hexadecimal(rounded(value - high))}}},")

normal = lambda p: sqrt(mpf(2)) * erfinv(2 * p - 1)


def tail(r):
    """The quantile whose upper tail probability is exp(-r^2), by Newton's method on log erfc."""
    x = sqrt(2) * r - (0 if r < 3 else log(sqrt(2) * r * sqrt(2 * pi)) / (sqrt(2) * r))
    x = max(x, mpf(1))
    for _ in range(60):
        q = mp.erfc(x / sqrt(2)) / 2
        delta = (log(q) + r**2) * q / (exp(-x**2 / 2) / sqrt(2 * pi))
        x += delta
        if abs(delta) < mpf(10)**-40:
            break
    return x


def centre(w):
    """normal(1/2 + q)/q as a function of (27/64)^2 - q^2."""
    q = sqrt(mpf(729) / 4096 - w)
    return normal(mpf(1) / 2 + q) / q if abs(q) > mpf(10)**-20 else sqrt(2 * pi)


mp.prec = 256
rational("normal, centre, in (27/64)^2 - q^2", centre, 0, mpf(729) / 4096, 7, 7)
rational("normal, tail, in r - 3/2, r in [1.59, 4.5]", lambda s: tail(s + mpf(3) / 2), mpf("0.09"), mpf(3), 7, 7)
rational("normal, far tail, in r - 9/2, r in [4.5, 27.3]", lambda s: tail(s + mpf(9) / 2), mpf(0), mpf("22.8"), 7, 7)
