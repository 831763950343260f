/* Formatted output to memory and to the robot's log. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "budget.h"
#include "core/math/elementary.h"
#include "image_abi.h"
#include "machine.h"
#include "weak.h"

extern struct KtExchange* kt_exchange;

static FILE input, output, errors;
FILE *stdin = &input, *stdout = &output, *stderr = &errors;

static uint32_t cycles_per_octet;
static uint8_t has_serial_line;

void kilotwin_serial_line(unsigned long baud) {
  enum { CLOCK_HZ = 8000000, BITS_PER_OCTET = 10 };
  has_serial_line = 1;
  cycles_per_octet = baud == 0 ? 0 : (uint32_t)(CLOCK_HZ * BITS_PER_OCTET / baud);
}

/* Writes to the log, and to the stream's function if it has one. */
static void put_into(FILE* stream, char c) {
  if (kt_exchange->log_length < KT_LOG_OCTETS)
    kt_exchange->log[kt_exchange->log_length++] = c;
  else
    ++kt_exchange->log_lost;
  if (cycles_per_octet != 0) kilotwin_spend(cycles_per_octet);
  if (stream != NULL && stream->put != NULL) stream->put(c, stream);
}

/* Cycles of a call that prints to a stream which nobody reads. On the robot it returns at once. Here the text goes to the log all
 * the same, which takes no time of the robot. */
enum { SILENT_CALL_CYCLES = 60 };

/* Begins output to a stream. Returns what end_output() needs. */
static int32_t begin_output(const FILE* stream) {
  const int32_t left = cycles_left();
  if (!has_serial_line && (stream == NULL || stream->put == NULL)) set_cycles_left(INT32_MAX);
  return left - SILENT_CALL_CYCLES;
}

static void end_output(const FILE* stream, int32_t left) {
  if (!has_serial_line && (stream == NULL || stream->put == NULL)) set_cycles_left(left);
}

struct Output {
  char* to; /* NULL: output goes to the stream */
  size_t size, length;
  FILE* stream;
};

static void put(struct Output* out, char c) {
  if (out->to == NULL && out->size > 0)
    put_into(out->stream, c);
  else if (out->length + 1 < out->size)
    out->to[out->length] = c;
  ++out->length;
}

static void fill(struct Output* out, char c, int count) {
  while (count-- > 0) put(out, c);
}

struct Field {
  int left, zero, plus, other, width, precision;
};

/* Writes `sign` (0: none) and `length` characters, padded to the field's width. */
static void put_field(struct Output* out, const struct Field* field, char sign, const char* text, int length) {
  const int space = field->width - length - (sign != 0);
  if (!field->left && !field->zero) fill(out, ' ', space);
  if (sign) put(out, sign);
  if (!field->left && field->zero) fill(out, '0', space);
  for (int i = 0; i < length; ++i) put(out, text[i]);
  if (field->left) fill(out, ' ', space);
}

/* Writes the digits of `value` right-aligned before `end`. Returns the address of the first. */
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

/* Writes "nan" or "inf" and returns 1; returns 0 for a finite value. */
static int put_not_finite(struct Output* out, struct Field* field, double value, char sign) {
  if (value - value == 0) return 0;
  field->zero = 0;
  put_field(out, field, value != value ? 0 : sign, value != value ? "nan" : "inf", 3);
  return 1;
}

static void put_fixed(struct Output* out, struct Field* field, double value) {
  const char sign = (char)(__builtin_signbit(value) && value == value ? '-' : field->plus ? '+' : 0);
  if (put_not_finite(out, field, value, sign)) return;
  if (value < 0) value = -value;
  const int decimals = field->precision < 0               ? 6
                       : field->precision > MOST_DECIMALS ? MOST_DECIMALS
                                                          : field->precision;
  uint64_t scale = 1;
  for (int i = 0; i < decimals; ++i) scale *= 10;
  /* Digits before the point beyond the first 18 are zeros. */
  int zeros = 0;
  for (; value >= 1e18; value /= 10) ++zeros;
  uint64_t whole = (uint64_t)kt_floor(value);
  uint64_t part = (uint64_t)kt_floor((value - (double)whole) * (double)scale + 0.5);
  if (part >= scale) {
    part -= scale;
    ++whole;
  }
  char text[320 + 2 * MOST_DIGITS];
  char* at = text + sizeof text;
  if (decimals > 0) {
    at = digits(at, part, 10, decimals, 'a');
    *--at = '.';
  }
  for (int i = 0; i < zeros; ++i) *--at = '0';
  at = digits(at, whole, 10, 1, 'a');
  put_field(out, field, sign, at, (int)(text + sizeof text - at));
}

/* %e and %g. %g uses the form of %f for decimal exponents from -4 to its precision, and drops trailing zeros. */
static void put_scientific(struct Output* out, struct Field* field, double value, char kind) {
  const char sign = (char)(__builtin_signbit(value) && value == value ? '-' : field->plus ? '+' : 0);
  if (put_not_finite(out, field, value, sign)) return;
  const int general = (kind | 32) == 'g';
  if (value < 0) value = -value;
  int places = field->precision < 0 ? 6 : field->precision > MOST_DECIMALS ? MOST_DECIMALS : field->precision;
  if (general) places = places > 0 ? places - 1 : 0;
  uint64_t scale = 1;
  for (int i = 0; i < places; ++i) scale *= 10;
  int tens = 0;
  double one = value;
  for (; one >= 10; one /= 10) ++tens;
  for (; one != 0 && one < 1; one *= 10) --tens;
  uint64_t shown = (uint64_t)kt_floor(one * (double)scale + 0.5);
  if (shown >= 10 * scale) {
    shown /= 10;
    ++tens;
  }
  const int fixed = general && tens >= -4 && tens <= places;
  char text[2 * MOST_DIGITS];
  char* at = text + sizeof text;
  int decimals = places;
  if (fixed) {
    decimals = places - tens;
  } else {
    at = digits(at, (uint64_t)(tens < 0 ? -tens : tens), 10, 2, 'a');
    *--at = tens < 0 ? '-' : '+';
    *--at = (char)(kind == 'g' ? 'e' : kind == 'G' ? 'E' : kind);
  }
  if (general && !field->other) {
    for (; decimals > 0 && shown % 10 == 0; --decimals) shown /= 10;
  }
  for (int i = 0; i < decimals; ++i, shown /= 10) *--at = (char)('0' + shown % 10);
  if (decimals > 0) *--at = '.';
  at = digits(at, shown, 10, 1, 'a');
  put_field(out, field, sign, at, (int)(text + sizeof text - at));
}

static size_t put_format(struct Output to, const char* format, va_list arguments) {
  struct Output out = to;
  for (; *format; ++format) {
    if (*format != '%') {
      put(&out, *format);
      continue;
    }
    struct Field field = {0, 0, 0, 0, 0, -1};
    for (++format;; ++format) {
      if (*format == '-')
        field.left = 1;
      else if (*format == '0')
        field.zero = 1;
      else if (*format == '+')
        field.plus = 1;
      else if (*format == '#')
        field.other = 1;
      else if (*format != ' ')
        break;
    }
    if (*format == '*') {
      field.width = va_arg(arguments, int);
      if (field.width < 0) {
        field.left = 1;
        field.width = -field.width;
      }
      ++format;
    }
    for (; *format >= '0' && *format <= '9'; ++format) field.width = field.width * 10 + *format - '0';
    if (*format == '.') {
      field.precision = 0;
      if (format[1] == '*') {
        field.precision = va_arg(arguments, int);
        ++format;
      }
      for (++format; *format >= '0' && *format <= '9'; ++format)
        field.precision = field.precision * 10 + *format - '0';
    }
    /* A single l has 32 bits, as on the robot; so have all values that the caller may have passed for it. */
    int longs = 0;
    for (; *format == 'h' || *format == 'l' || *format == 'z'; ++format)
      longs += *format == 'l' ? 1 : *format == 'z' ? 2 : 0;
    switch (*format) {
      case 'd':
      case 'i': {
        const int64_t value = longs > 1 ? va_arg(arguments, long) : va_arg(arguments, int);
        put_integer(&out, &field, value < 0 ? 0 - (uint64_t)value : (uint64_t)value,
                    (char)(value < 0    ? '-'
                           : field.plus ? '+'
                                        : 0),
                    10, 'a');
        break;
      }
      case 'u':
      case 'o':
      case 'x':
      case 'X': {
        const uint64_t value = longs > 1 ? va_arg(arguments, unsigned long) : va_arg(arguments, unsigned);
        const unsigned base = *format == 'u' ? 10 : *format == 'o' ? 8 : 16;
        if (field.other && base == 16 && value != 0) {
          put(&out, '0');
          put(&out, *format);
        }
        put_integer(&out, &field, value, 0, base, *format == 'X' ? 'A' : 'a');
        break;
      }
      case 'p': put_integer(&out, &field, (uint64_t)va_arg(arguments, void*), 0, 16, 'a'); break;
      case 'f':
      case 'F': put_fixed(&out, &field, va_arg(arguments, double)); break;
      case 'e':
      case 'E':
      case 'g':
      case 'G': put_scientific(&out, &field, va_arg(arguments, double), *format); break;
      case 'c': {
        const char c = (char)va_arg(arguments, int);
        put_field(&out, &field, 0, &c, 1);
        break;
      }
      case 'S':
      case 's': {
        const char* text = va_arg(arguments, const char*);
        if (text == NULL) text = "(null)";
        const size_t most = field.precision < 0 ? (size_t)1 << 30 : (size_t)field.precision;
        field.zero = 0;
        put_field(&out, &field, 0, text, (int)strnlen(text, most));
        break;
      }
      case 0: --format; break;
      default: put(&out, *format);
    }
  }
  return out.length;
}

int vsnprintf(char* to, size_t size, const char* format, va_list arguments) {
  const struct Output out = {to, to == NULL ? 0 : size, 0, NULL};
  const size_t length = put_format(out, format, arguments);
  if (out.size > 0) to[length < size ? length : size - 1] = 0;
  return (int)length;
}

int vfprintf(FILE* stream, const char* format, va_list arguments) {
  const int32_t left = begin_output(stream);
  const struct Output out = {NULL, 1, 0, stream};
  const int length = (int)put_format(out, format, arguments);
  end_output(stream, left);
  return length;
}

int vprintf(const char* format, va_list arguments) { return vfprintf(stdout, format, arguments); }
int vsprintf(char* to, const char* format, va_list arguments) {
  return vsnprintf(to, (size_t)1 << 30, format, arguments);
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

int fprintf(FILE* stream, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vfprintf(stream, format, arguments);
  va_end(arguments);
  return length;
}

int printf(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vfprintf(stdout, format, arguments);
  va_end(arguments);
  return length;
}

/* printf() for the runtime's macros: without DEBUG, debug.h defines printf() as nothing. */
int kilotwin_print(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int length = vfprintf(stderr, format, arguments);
  va_end(arguments);
  return length;
}

int fputc(int c, FILE* stream) {
  put_into(stream, (char)c);
  return (unsigned char)c;
}

int fputs(const char* text, FILE* stream) {
  const int32_t left = begin_output(stream);
  for (; *text; ++text) put_into(stream, *text);
  end_output(stream, left);
  return 0;
}

size_t fwrite(const void* from, size_t size, size_t count, FILE* stream) {
  for (size_t i = 0; i < size * count; ++i) put_into(stream, ((const char*)from)[i]);
  return count;
}

int puts(const char* text) {
  fputs(text, stdout);
  return fputc('\n', stdout);
}

int putc(int c, FILE* stream) { return fputc(c, stream); }
int putchar(int c) { return fputc(c, stdout); }

void perror(const char* text) {
  fputs(text, stderr);
  fputs(": error\n", stderr);
}

int fflush(FILE* stream) {
  (void)stream;
  return 0;
}

FILE* fdevopen(int (*put_octet)(char, FILE*), int (*get)(FILE*)) {
  fdev_setup_stream(stdout, put_octet, get, _FDEV_SETUP_RW);
  return stdout;
}

/* Robots have no files and no input, so these functions fail. */
FILE* fopen(const char* name, const char* mode) {
  (void)name, (void)mode;
  return NULL;
}

int fclose(FILE* stream) {
  (void)stream;
  return 0;
}

int scanf(const char* format, ...) {
  (void)format;
  return EOF;
}

int fscanf(FILE* stream, const char* format, ...) {
  (void)stream, (void)format;
  return EOF;
}

char* fgets(char* to, int size, FILE* stream) {
  (void)to, (void)size, (void)stream;
  return NULL;
}

int fgetc(FILE* stream) { return stream != NULL && stream->get != NULL ? stream->get(stream) : EOF; }
int getc(FILE* stream) { return fgetc(stream); }
int getchar(void) { return fgetc(stdin); }

size_t fread(void* to, size_t size, size_t count, FILE* stream) {
  (void)to, (void)size, (void)count, (void)stream;
  return 0;
}

int fseek(FILE* stream, long offset, int from) {
  (void)stream, (void)offset, (void)from;
  return -1;
}

long ftell(FILE* stream) {
  (void)stream;
  return -1;
}

void rewind(FILE* stream) { (void)stream; }

int remove(const char* name) {
  (void)name;
  return -1;
}

int feof(FILE* stream) {
  (void)stream;
  return 1;
}

int ferror(FILE* stream) {
  (void)stream;
  return 0;
}

void clearerr(FILE* stream) { (void)stream; }
