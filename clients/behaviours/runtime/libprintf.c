/* Formatting into memory. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "core/math/elementary.h"
#include "weak.h"

struct Output {
  char* to;
  size_t size, length;
};

static void put(struct Output* out, char c) {
  if (out->length + 1 < out->size) out->to[out->length] = c;
  ++out->length;
}

static void fill(struct Output* out, char c, int count) {
  while (count-- > 0) put(out, c);
}

struct Field {
  int left, zero, plus, width, precision;
};

/* `sign` (0: none) and `length` characters, padded to the field. */
static void put_field(struct Output* out, const struct Field* field, char sign, const char* text, int length) {
  const int space = field->width - length - (sign != 0);
  if (!field->left && !field->zero) fill(out, ' ', space);
  if (sign) put(out, sign);
  if (!field->left && field->zero) fill(out, '0', space);
  for (int i = 0; i < length; ++i) put(out, text[i]);
  if (field->left) fill(out, ' ', space);
}

/* Digits of `value`, right-aligned before `end`; the address of the first. */
static char* digits(char* end, uint64_t value, unsigned base, int least, char ten) {
  char* at = end;
  for (; value != 0 || end - at < least; value /= base) {
    const char digit = (char)(value % base);
    *--at = (char)(digit < 10 ? '0' + digit : ten + digit - 10);
  }
  return at;
}

enum { MOST_DIGITS = 40, MOST_DECIMALS = 15 };

static void put_integer(struct Output* out, struct Field* field, uint64_t value, char sign, unsigned base,
                        char ten) {
  char text[MOST_DIGITS];
  int least = field->precision < 0 ? 1 : field->precision;
  if (least > MOST_DIGITS) least = MOST_DIGITS;
  if (field->precision >= 0) field->zero = 0;
  const char* first = digits(text + MOST_DIGITS, value, base, least, ten);
  put_field(out, field, sign, first, (int)(text + MOST_DIGITS - first));
}

static void put_real(struct Output* out, struct Field* field, double value) {
  const char sign = (char)(value < 0 ? '-' : field->plus ? '+' : 0);
  if (value != value || value - value != 0) {
    field->zero = 0;
    put_field(out, field, value != value ? 0 : sign, value != value ? "nan" : "inf", 3);
    return;
  }
  if (value < 0) value = -value;
  int decimals = field->precision < 0 ? 6 : field->precision > MOST_DECIMALS ? MOST_DECIMALS : field->precision;
  uint64_t scale = 1;
  for (int i = 0; i < decimals; ++i) scale *= 10;
  char text[2 * MOST_DIGITS];
  char* at = text + sizeof text;
  if (value < 1e18) {
    uint64_t whole = (uint64_t)kt_floor(value);
    uint64_t part = (uint64_t)kt_floor((value - (double)whole) * (double)scale + 0.5);
    if (part >= scale) {
      part -= scale;
      ++whole;
    }
    if (decimals > 0) {
      at = digits(at, part, 10, decimals, 'a');
      *--at = '.';
    }
    at = digits(at, whole, 10, 1, 'a');
  } else {
    at -= 3;
    memcpy(at, "big", 3);
  }
  put_field(out, field, sign, at, (int)(text + sizeof text - at));
}

int vsnprintf(char* to, size_t size, const char* format, va_list arguments) {
  struct Output out = {to, size, 0};
  for (; *format; ++format) {
    if (*format != '%') {
      put(&out, *format);
      continue;
    }
    struct Field field = {0, 0, 0, 0, -1};
    for (++format;; ++format) {
      if (*format == '-')
        field.left = 1;
      else if (*format == '0')
        field.zero = 1;
      else if (*format == '+')
        field.plus = 1;
      else
        break;
    }
    if (*format == '*') {
      field.width = va_arg(arguments, int);
      ++format;
    }
    for (; *format >= '0' && *format <= '9'; ++format) field.width = field.width * 10 + *format - '0';
    if (*format == '.') {
      field.precision = 0;
      for (++format; *format >= '0' && *format <= '9'; ++format)
        field.precision = field.precision * 10 + *format - '0';
    }
    int longs = 0;
    for (; *format == 'h' || *format == 'l' || *format == 'z'; ++format) longs += *format != 'h';
    switch (*format) {
      case 'd':
      case 'i': {
        const int64_t value = longs ? va_arg(arguments, long) : va_arg(arguments, int);
        put_integer(&out, &field, value < 0 ? 0 - (uint64_t)value : (uint64_t)value,
                    (char)(value < 0    ? '-'
                           : field.plus ? '+'
                                        : 0),
                    10, 'a');
        break;
      }
      case 'u':
      case 'x':
      case 'X': {
        const uint64_t value = longs ? va_arg(arguments, unsigned long) : va_arg(arguments, unsigned);
        put_integer(&out, &field, value, 0, *format == 'u' ? 10 : 16, *format == 'X' ? 'A' : 'a');
        break;
      }
      case 'p': put_integer(&out, &field, (uint64_t)va_arg(arguments, void*), 0, 16, 'a'); break;
      case 'f':
      case 'g':
      case 'e': put_real(&out, &field, va_arg(arguments, double)); break;
      case 'c': {
        const char c = (char)va_arg(arguments, int);
        put_field(&out, &field, 0, &c, 1);
        break;
      }
      case 's': {
        const char* text = va_arg(arguments, const char*);
        const size_t most = field.precision < 0 ? (size_t)1 << 30 : (size_t)field.precision;
        field.zero = 0;
        put_field(&out, &field, 0, text, (int)strnlen(text, most));
        break;
      }
      case 0: --format; break;
      default: put(&out, *format);
    }
  }
  if (size > 0) to[out.length < size ? out.length : size - 1] = 0;
  return (int)out.length;
}

int snprintf(char* to, size_t size, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vsnprintf(to, size, format, arguments);
  va_end(arguments);
  return length;
}

int sprintf(char* to, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vsnprintf(to, (size_t)1 << 30, format, arguments);
  va_end(arguments);
  return length;
}

int printf(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vsnprintf((char*)0, 0, format, arguments);
  va_end(arguments);
  return length;
}

int puts(const char* text) { return (int)strlen(text) + 1; }
int putchar(int c) { return (unsigned char)c; }
