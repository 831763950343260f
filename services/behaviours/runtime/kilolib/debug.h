/* Debugging by printf(), on the robot over its serial line. With DEBUG the text goes to the robot's log; after debug_init() it
 * also takes the transmission time of 38400 baud. Without DEBUG printf() compiles to nothing. Also the debug_info_ macros of
 * ARGoS, which access a structure debug_info_t that the program defines. */
#ifndef KILOTWIN_DEBUG_H
#define KILOTWIN_DEBUG_H

#ifdef __cplusplus
extern "C" {
#endif

#ifdef DEBUG

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdio.h>

#ifndef BAUD
#define BAUD 38400
#endif

#ifdef __AVR__

static int debug_putchar(char c, FILE* stream) {
  (void)stream;
  UDR0 = c;
  loop_until_bit_is_set(UCSR0A, UDRE0);
  return 0;
}

static void debug_init(void) {
  static FILE debug_stdout = FDEV_SETUP_STREAM(debug_putchar, NULL, _FDEV_SETUP_WRITE);
  DDRD |= _BV(1);
#include <util/setbaud.h>
  UBRR0 = UBRR_VALUE;
  UCSR0C |= _BV(UCSZ01) | _BV(UCSZ00);
  UCSR0B |= _BV(TXEN0);
  stdout = &debug_stdout;
}

#else

void kilotwin_serial_line(unsigned long baud);

static inline void debug_init(void) {
#ifdef NONBLOCKING
  kilotwin_serial_line(0);
#else
  kilotwin_serial_line(BAUD);
#endif
}

#endif

#else

#define debug_init()
#define printf(...)

#endif

/* A program that sets fields without a definition of debug_info_t was written for the robot, where the macros are empty. */
#if defined(__AVR__) || defined(KILOTWIN_NO_DEBUG_INFO)

#define debug_info_create() ((void)0)
#define debug_info_destroy() ((void)0)
#define debug_info_set(field, value)
#define debug_info_get(field)
#else

void* kilotwin_debug_info(unsigned long size);

#define debug_info_create() ((void)0)
#define debug_info_destroy() ((void)0)
#define debug_info_get(field) (((debug_info_t*)kilotwin_debug_info(sizeof(debug_info_t)))->field)
#define debug_info_set(field, value) (debug_info_get(field) = (value))

#endif

#ifdef __AVR__
#define debug_print(...)
#else
int kilotwin_print(const char* format, ...);
#define debug_print(...) kilotwin_print(__VA_ARGS__)
#endif

#ifdef __cplusplus
}
#endif

#endif
