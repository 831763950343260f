/* Strings, characters, sorting and random numbers of the C library. */
#include <ctype.h>
#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "budget.h"
#include "weak.h"

_Noreturn void kilotwin_end(void);

_Noreturn void exit(int status) {
  (void)status;
  kilotwin_end();
}

_Noreturn void abort(void) { __builtin_trap(); }

void* memcpy(void* to, const void* from, size_t size) {
  void* start = to;
  __asm__ volatile("rep movsb" : "+D"(to), "+S"(from), "+c"(size) : : "memory");
  return start;
}

void* memmove(void* to, const void* from, size_t size) {
  if ((uintptr_t)to - (uintptr_t)from >= size) return memcpy(to, from, size);
  volatile unsigned char* t = to;
  const unsigned char* f = from;
  while (size-- > 0) t[size] = f[size];
  return to;
}

void* memset(void* to, int value, size_t size) {
  void* start = to;
  __asm__ volatile("rep stosb" : "+D"(to), "+c"(size) : "a"(value) : "memory");
  return start;
}

int memcmp(const void* a, const void* b, size_t size) {
  const unsigned char *x = a, *y = b;
  for (; size > 0; --size, ++x, ++y) {
    if (*x != *y) return *x - *y;
  }
  return 0;
}

void* memchr(const void* in, int value, size_t size) {
  for (const unsigned char* x = in; size > 0; --size, ++x) {
    if (*x == (unsigned char)value) return (void*)x;
  }
  return NULL;
}

size_t strnlen(const char* text, size_t most) {
  const volatile char* at = text;
  size_t length = 0;
  while (length < most && at[length] != 0) ++length;
  return length;
}

size_t strlen(const char* text) { return strnlen(text, SIZE_MAX); }

int strncmp(const char* a, const char* b, size_t most) {
  for (; most > 0; --most, ++a, ++b) {
    if (*a != *b || *a == 0) return (unsigned char)*a - (unsigned char)*b;
  }
  return 0;
}

int strcmp(const char* a, const char* b) { return strncmp(a, b, SIZE_MAX); }

char* strcpy(char* to, const char* from) { return memcpy(to, from, strlen(from) + 1); }

char* strncpy(char* to, const char* from, size_t size) {
  const size_t length = strnlen(from, size);
  memcpy(to, from, length);
  memset(to + length, 0, size - length);
  return to;
}

char* strcat(char* to, const char* from) {
  strcpy(to + strlen(to), from);
  return to;
}

char* stpcpy(char* to, const char* from) {
  const size_t length = strlen(from);
  memcpy(to, from, length + 1);
  return to + length;
}

char* strncat(char* to, const char* from, size_t most) {
  const size_t length = strnlen(from, most);
  char* end = to + strlen(to);
  memcpy(end, from, length);
  end[length] = 0;
  return to;
}

size_t strlcpy(char* to, const char* from, size_t size) {
  const size_t length = strlen(from);
  if (size > 0) {
    const size_t copied = length < size ? length : size - 1;
    memcpy(to, from, copied);
    to[copied] = 0;
  }
  return length;
}

size_t strlcat(char* to, const char* from, size_t size) {
  const size_t length = strnlen(to, size);
  return length + strlcpy(to + length, from, size - length);
}

void* memccpy(void* to, const void* from, int last, size_t size) {
  unsigned char* t = to;
  const unsigned char* f = from;
  while (size-- > 0) {
    if ((*t++ = *f++) == (unsigned char)last) return t;
  }
  return NULL;
}

char* strchr(const char* text, int c) { return memchr(text, c, strlen(text) + 1); }

char* strrchr(const char* text, int c) {
  for (size_t i = strlen(text) + 1; i-- > 0;) {
    if (text[i] == (char)c) return (char*)text + i;
  }
  return NULL;
}

char* strstr(const char* text, const char* part) {
  const size_t length = strlen(part);
  for (;; ++text) {
    if (strncmp(text, part, length) == 0) return (char*)text;
    if (*text == 0) return NULL;
  }
}

size_t strspn(const char* text, const char* of) {
  size_t length = 0;
  while (text[length] != 0 && strchr(of, text[length]) != NULL) ++length;
  return length;
}

size_t strcspn(const char* text, const char* not_of) {
  size_t length = 0;
  while (text[length] != 0 && strchr(not_of, text[length]) == NULL) ++length;
  return length;
}

char* strpbrk(const char* text, const char* any_of) {
  text += strcspn(text, any_of);
  return *text == 0 ? NULL : (char*)text;
}

char* strtok_r(char* text, const char* between, char** place) {
  if (text == NULL) text = *place;
  if (text == NULL) return NULL;
  text += strspn(text, between);
  if (*text == 0) {
    *place = NULL;
    return NULL;
  }
  char* end = text + strcspn(text, between);
  *place = *end == 0 ? NULL : end + 1;
  *end = 0;
  return text;
}

static char* token_place;

char* strtok(char* text, const char* between) { return strtok_r(text, between, &token_place); }

char* strsep(char** text, const char* between) {
  char* first = *text;
  if (first == NULL) return NULL;
  char* end = first + strcspn(first, between);
  *text = *end == 0 ? NULL : end + 1;
  *end = 0;
  return first;
}

char* strdup(const char* text) {
  char* copy = malloc(strlen(text) + 1);
  return copy == NULL ? NULL : strcpy(copy, text);
}

char* strlwr(char* text) {
  for (char* at = text; *at; ++at) *at = (char)tolower(*at);
  return text;
}

char* strupr(char* text) {
  for (char* at = text; *at; ++at) *at = (char)toupper(*at);
  return text;
}

char* strrev(char* text) {
  for (size_t i = 0, k = strlen(text); i + 1 < k; ++i) {
    const char swapped = text[i];
    text[i] = text[--k];
    text[k] = swapped;
  }
  return text;
}

char* strerror(int number) {
  (void)number;
  return (char*)"error";
}

int strncasecmp(const char* a, const char* b, size_t most) {
  for (; most > 0; --most, ++a, ++b) {
    const int difference = tolower((unsigned char)*a) - tolower((unsigned char)*b);
    if (difference != 0 || *a == 0) return difference;
  }
  return 0;
}

int strcasecmp(const char* a, const char* b) { return strncasecmp(a, b, SIZE_MAX); }

int isdigit(int c) { return c >= '0' && c <= '9'; }
int isupper(int c) { return c >= 'A' && c <= 'Z'; }
int islower(int c) { return c >= 'a' && c <= 'z'; }
int isxdigit(int c) { return isdigit(c) || (c >= 'A' && c <= 'F') || (c >= 'a' && c <= 'f'); }
int isalpha(int c) { return isupper(c) || islower(c); }
int isalnum(int c) { return isalpha(c) || isdigit(c); }
int isspace(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
int isblank(int c) { return c == ' ' || c == '\t'; }
int iscntrl(int c) { return (c >= 0 && c < ' ') || c == 127; }
int isprint(int c) { return c >= ' ' && c < 127; }
int isgraph(int c) { return c > ' ' && c < 127; }
int ispunct(int c) { return isgraph(c) && !isalnum(c); }
int isascii(int c) { return c >= 0 && c < 128; }
int toascii(int c) { return c & 127; }
int toupper(int c) { return islower(c) ? c - 'a' + 'A' : c; }
int tolower(int c) { return isupper(c) ? c - 'A' + 'a' : c; }

int abs(int value) { return value < 0 ? -value : value; }
long labs(long value) { return value < 0 ? -value : value; }
long long llabs(long long value) { return value < 0 ? -value : value; }

/* The generator of Park and Miller in Schrage's form, as in avr-libc: a state of 0 stands for 123459876. */
static int32_t next_random(int32_t* state) {
  enum { LONG_DIVISION_CYCLES = 410 }; /* what its division takes longer than that of an int, which is counted */
  charge(LONG_DIVISION_CYCLES);
  int32_t x = *state == 0 ? 123459876 : *state;
  x = 16807 * (x % 127773) - 2836 * (x / 127773);
  if (x < 0) x += 0x7fffffff;
  return *state = x;
}

static int32_t rand_state = 1, random_state = 1;

int rand(void) { return (int)((uint32_t)next_random(&rand_state) % ((uint32_t)RAND_MAX + 1)); }
void srand(unsigned seed) { rand_state = (int32_t)(uint16_t)seed; }

/* Of a caller's state the low 32 bits: an unsigned long of a program with the robot's int has no more. */
static uint32_t next_of(unsigned long* state) {
  int32_t x;
  memcpy(&x, state, sizeof x);
  next_random(&x);
  memcpy(state, &x, sizeof x);
  return (uint32_t)x;
}

int rand_r(unsigned long* state) { return (int)(next_of(state) % ((uint32_t)RAND_MAX + 1)); }

long random(void) { return (long)((uint32_t)next_random(&random_state) % ((uint32_t)RANDOM_MAX + 1)); }
void srandom(unsigned long seed) { random_state = (int32_t)seed; }

long random_r(unsigned long* state) { return (long)next_of(state); }

/* Insertion sort: stable, small, and fast enough for a robot's few elements. Comparators return the robot's int, 16 bits. */
void qsort(void* base, size_t count, size_t size, int (*compare)(const void*, const void*)) {
  unsigned char* first = base;
  for (size_t i = 1; i < count; ++i) {
    for (unsigned char* at = first + i * size; at > first && (int16_t)compare(at - size, at) > 0; at -= size) {
      for (size_t k = 0; k < size; ++k) {
        const unsigned char swapped = at[k];
        at[k] = at[k - size];
        at[k - size] = swapped;
      }
    }
  }
}

void* bsearch(const void* key, const void* base, size_t count, size_t size,
              int (*compare)(const void*, const void*)) {
  const unsigned char* first = base;
  while (count > 0) {
    const unsigned char* middle = first + count / 2 * size;
    const int order = (int16_t)compare(key, middle);
    if (order == 0) return (void*)middle;
    if (order > 0) {
      first = middle + size;
      count -= count / 2 + 1;
    } else {
      count /= 2;
    }
  }
  return NULL;
}

div_t div(int numerator, int denominator) {
  const div_t result = {numerator / denominator, numerator % denominator};
  return result;
}

ldiv_t ldiv(long numerator, long denominator) {
  const ldiv_t result = {numerator / denominator, numerator % denominator};
  return result;
}

char* getenv(const char* name) {
  (void)name;
  return NULL;
}

/* A robot's program does not end, so the function is never called. */
int atexit(void (*function)(void)) {
  (void)function;
  return 0;
}

int errno;
