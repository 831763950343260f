/* The part of the C library that robots' programs use. rand() is avr-libc's, value for value. */
#ifndef KILOTWIN_STDLIB_H
#define KILOTWIN_STDLIB_H

#include <stddef.h>

#define RAND_MAX 0x7fff
#define RANDOM_MAX 0x7fffffff
#define EXIT_SUCCESS 0
#define EXIT_FAILURE 1

int abs(int value);
long labs(long value);
long long llabs(long long value);
int atoi(const char* text);
long atol(const char* text);
int rand(void);
void srand(unsigned seed);
int rand_r(unsigned long* state);
long random(void);
void srandom(unsigned long seed);
void qsort(void* base, size_t count, size_t size, int (*compare)(const void*, const void*));
void* bsearch(const void* key, const void* base, size_t count, size_t size,
              int (*compare)(const void*, const void*));
/* A robot's heap has 4 KiB. */
void* malloc(size_t size);
void* calloc(size_t count, size_t size);
void* realloc(void* block, size_t size);
void free(void* block);
_Noreturn void exit(int status);
_Noreturn void abort(void);

#endif
