/* Conversion of numbers to text and back. */
#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "weak.h"

static int digit_of(char c) { return isdigit(c) ? c - '0' : isalpha(c) ? tolower(c) - 'a' + 10 : 36; }

/* Parses a magnitude. `high` becomes 1 if it exceeds 64 bits. `end` becomes the first unread character, or `text` on failure. */
static uint64_t magnitude(const char* text, const char** end, int base, int* negative, int* high) {
  const char* at = text;
  *end = text;
  *high = 0;
  while (isspace(*at)) ++at;
  *negative = *at == '-';
  if (*at == '-' || *at == '+') ++at;
  if ((base == 0 || base == 16) && at[0] == '0' && (at[1] | 32) == 'x' && digit_of(at[2]) < 16) {
    at += 2;
    base = 16;
  } else if (base == 0) {
    base = *at == '0' ? 8 : 10;
  }
  uint64_t value = 0;
  for (; digit_of(*at) < base; *end = ++at) {
    const uint64_t more = value * (uint64_t)base + (uint64_t)digit_of(*at);
    if (more / (uint64_t)base != value) *high = 1;
    value = more;
  }
  return value;
}

long long strtoll(const char* text, char** end, int base) {
  const char* stop;
  int negative, high;
  const uint64_t value = magnitude(text, &stop, base, &negative, &high);
  if (end != NULL) *end = (char*)stop;
  if (high || value > (uint64_t)LLONG_MAX + (uint64_t)negative) {
    errno = ERANGE;
    return negative ? LLONG_MIN : LLONG_MAX;
  }
  return (long long)(negative ? 0 - value : value);
}

unsigned long long strtoull(const char* text, char** end, int base) {
  const char* stop;
  int negative, high;
  const uint64_t value = magnitude(text, &stop, base, &negative, &high);
  if (end != NULL) *end = (char*)stop;
  if (high) errno = ERANGE;
  return high ? ULLONG_MAX : negative ? 0 - value : value;
}

long strtol(const char* text, char** end, int base) { return strtoll(text, end, base); }
unsigned long strtoul(const char* text, char** end, int base) { return strtoull(text, end, base); }
long long atoll(const char* text) { return strtoll(text, NULL, 10); }
long atol(const char* text) { return strtol(text, NULL, 10); }
int atoi(const char* text) { return (int)strtol(text, NULL, 10); }

/* Uses the first 19 digits, and multiplies or divides by 10 one step at a time. The result is not always correctly rounded. */
double strtod(const char* text, char** end) {
  const char* at = text;
  while (isspace(*at)) ++at;
  const int negative = *at == '-';
  if (*at == '-' || *at == '+') ++at;
  double value = 0;
  if (strncasecmp(at, "inf", 3) == 0) {
    value = INFINITY;
    at += 3;
  } else if (strncasecmp(at, "nan", 3) == 0) {
    value = NAN;
    at += 3;
  } else {
    uint64_t digits = 0;
    int tens = 0, any = 0, point = 0;
    for (;; ++at) {
      if (*at == '.' && !point) {
        point = 1;
        continue;
      }
      if (!isdigit(*at)) break;
      any = 1;
      if (digits < UINT64_MAX / 10 - 1) {
        digits = digits * 10 + (uint64_t)(*at - '0');
        tens -= point;
      } else {
        tens += !point;
      }
    }
    if (!any) {
      if (end != NULL) *end = (char*)text;
      return 0;
    }
    if ((*at | 32) == 'e' && (isdigit(at[1]) || ((at[1] == '-' || at[1] == '+') && isdigit(at[2])))) {
      char* stop;
      const long exponent = strtol(at + 1, &stop, 10);
      tens += (int)(exponent > 400 ? 400 : exponent < -400 ? -400 : exponent);
      at = stop;
    }
    double scale = 1;
    for (int i = 0; i < (tens < 0 ? -tens : tens) && scale < 1e300; ++i) scale *= 10;
    value = tens < 0 ? (double)digits / scale : (double)digits * scale;
  }
  if (end != NULL) *end = (char*)at;
  return negative ? -value : value;
}

float strtof(const char* text, char** end) { return (float)strtod(text, end); }
double atof(const char* text) { return strtod(text, NULL); }

static char* write_digits(uint64_t value, char* to, int base) {
  char* at = to;
  do {
    const int digit = (int)(value % (uint64_t)base);
    *at++ = (char)(digit < 10 ? '0' + digit : 'a' + digit - 10);
    value /= (uint64_t)base;
  } while (value != 0);
  *at = 0;
  strrev(to);
  return to;
}

char* ultoa(unsigned long value, char* to, int base) {
  if (base < 2 || base > 36) {
    *to = 0;
    return to;
  }
  return write_digits(value, to, base);
}

char* ltoa(long value, char* to, int base) {
  if (base == 10 && value < 0) {
    *to = '-';
    write_digits(0 - (uint64_t)value, to + 1, base);
    return to;
  }
  return ultoa((unsigned long)value, to, base);
}

char* utoa(unsigned value, char* to, int base) { return ultoa(value, to, base); }
char* itoa(int value, char* to, int base) {
  return base == 10 ? ltoa(value, to, 10) : ultoa((unsigned)value, to, base);
}

char* dtostrf(double value, signed char width, unsigned char decimals, char* to) {
  if (width < 0)
    sprintf(to, "%-*.*f", -width, decimals, value);
  else
    sprintf(to, "%*.*f", width, decimals, value);
  return to;
}

/* One conversion of sscanf(); `width` counts characters. Returns the first unread character, or NULL if the text does not match. */
static const char* convert(const char* text, char kind, int width, int longs, void* to) {
  char copy[64];
  char* stop;
  while (isspace(*text)) ++text;
  strlcpy(copy, text, width > 0 && width < 63 ? (size_t)width + 1 : sizeof copy);
  if (kind == 'f') {
    const double value = strtod(copy, &stop);
    if (stop == copy) return NULL;
    if (to != NULL && longs > 0)
      *(double*)to = value;
    else if (to != NULL)
      *(float*)to = (float)value;
    return text + (stop - copy);
  }
  const long long value = strtoll(copy, &stop, kind == 'x' ? 16 : kind == 'o' ? 8 : kind == 'i' ? 0 : 10);
  if (stop == copy) return NULL;
  if (to != NULL) {
    switch (longs) {
      case -2: *(signed char*)to = (signed char)value; break;
      case -1: *(short*)to = (short)value; break;
      case 0: *(int*)to = (int)value; break;
      default: *(long long*)to = value;
    }
  }
  return text + (stop - copy);
}

int vsscanf(const char* text, const char* format, va_list arguments) {
  const char* const start = text;
  int converted = 0;
  for (; *format; ++format) {
    if (isspace(*format)) {
      while (isspace(*text)) ++text;
      continue;
    }
    if (*format != '%' || *++format == '%') {
      if (*text != *format) return *text == 0 && converted == 0 ? EOF : converted;
      ++text;
      continue;
    }
    const int skips = *format == '*';
    if (skips) ++format;
    int width = 0, longs = 0;
    for (; isdigit(*format); ++format) width = width * 10 + *format - '0';
    for (;; ++format) {
      if (*format == 'l')
        ++longs;
      else if (*format == 'h')
        --longs;
      else
        break;
    }
    void* to = skips ? NULL : va_arg(arguments, void*);
    if (*format == 'n') {
      if (to != NULL) *(int*)to = (int)(text - start);
      continue;
    }
    if (*format != 'c') {
      while (isspace(*text)) ++text;
    }
    if (*text == 0) return converted == 0 ? EOF : converted;
    if (*format == 'c') {
      for (int i = 0; i < (width > 0 ? width : 1) && *text; ++i, ++text) {
        if (to != NULL) ((char*)to)[i] = *text;
      }
    } else if (*format == 's') {
      char* at = to;
      for (int i = 0; (width == 0 || i < width) && *text && !isspace(*text); ++i, ++text) {
        if (at != NULL) *at++ = *text;
      }
      if (at != NULL) *at = 0;
    } else {
      const char kind = *format == 'd' || *format == 'u'                     ? 'd'
                        : *format == 'i'                                     ? 'i'
                        : *format == 'o'                                     ? 'o'
                        : *format == 'x' || *format == 'X' || *format == 'p' ? 'x'
                                                                             : 'f';
      const char* next = convert(text, kind, width, *format == 'p' ? 1 : longs, to);
      if (next == NULL) return converted;
      text = next;
    }
    converted += !skips;
  }
  return converted;
}

int sscanf(const char* text, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int converted = vsscanf(text, format, arguments);
  va_end(arguments);
  return converted;
}
