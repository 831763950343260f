/* The part of the C library that robots' programs use. rand() returns the values of avr-libc. */
#ifndef KILOTWIN_STDLIB_H
#define KILOTWIN_STDLIB_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RAND_MAX 0x7fff
#define RANDOM_MAX 0x7fffffff
#define EXIT_SUCCESS 0
#define EXIT_FAILURE 1
#define alloca(size) __builtin_alloca(size)

typedef struct {
  int quot, rem;
} div_t;
typedef struct {
  long quot, rem;
} ldiv_t;

int abs(int value);
long labs(long value);
long long llabs(long long value);
div_t div(int numerator, int denominator);
ldiv_t ldiv(long numerator, long denominator);
int atoi(const char* text);
long atol(const char* text);
long long atoll(const char* text);
double atof(const char* text);
long strtol(const char* text, char** end, int base);
unsigned long strtoul(const char* text, char** end, int base);
long long strtoll(const char* text, char** end, int base);
unsigned long long strtoull(const char* text, char** end, int base);
double strtod(const char* text, char** end);
float strtof(const char* text, char** end);
/* As in avr-libc: a number as text in base 2..36, with a sign only in base 10. */
char* itoa(int value, char* to, int base);
char* ltoa(long value, char* to, int base);
char* utoa(unsigned value, char* to, int base);
char* ultoa(unsigned long value, char* to, int base);
/* As in avr-libc: fixed point with `decimals` decimals, right-aligned in `width`, or left-aligned if `width` is negative. */
char* dtostrf(double value, signed char width, unsigned char decimals, char* to);
int rand(void);
void srand(unsigned seed);
/* The robot's unsigned long has 32 bits. Both functions use no more. */
#ifdef KILOTWIN_ROBOT_INT
int rand_r(unsigned int* state);
long random_r(unsigned int* state);
#else
int rand_r(unsigned long* state);
long random_r(unsigned long* state);
#ifdef __cplusplus
/* Programs may pass a uint32_t, which is the robot's unsigned long. */
extern "C++" {
inline int rand_r(unsigned int* state) {
  unsigned long wide = *state;
  const int number = rand_r(&wide);
  *state = (unsigned int)wide;
  return number;
}
inline long random_r(unsigned int* state) {
  unsigned long wide = *state;
  const long number = random_r(&wide);
  *state = (unsigned int)wide;
  return number;
}
}
#endif
#endif
long random(void);
void srandom(unsigned long seed);
void qsort(void* base, size_t count, size_t size, int (*compare)(const void*, const void*));
void* bsearch(const void* key, const void* base, size_t count, size_t size,
              int (*compare)(const void*, const void*));
/* A robot's heap has 64 KiB. */
void* malloc(size_t size);
void* calloc(size_t count, size_t size);
void* realloc(void* block, size_t size);
void free(void* block);
char* getenv(const char* name);
int atexit(void (*function)(void));
void exit(int status) __attribute__((noreturn));
void abort(void) __attribute__((noreturn));

#ifdef __cplusplus
}
#endif

#endif
