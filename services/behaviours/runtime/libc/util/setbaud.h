/* Settings of a serial line at BAUD: normal speed if its error is within BAUD_TOL percent, else double speed. No include guard,
 * because programs include it once per rate. */
#ifndef BAUD
#error "setbaud.h needs BAUD; #define BAUD 38400 before it is included"
#endif
#ifndef BAUD_TOL
#define BAUD_TOL 2
#endif
#undef USE_2X
#undef UBRR_VALUE
#undef UBRRL_VALUE
#undef UBRRH_VALUE
#define UBRR_VALUE (((F_CPU) + 8UL * (BAUD)) / (16UL * (BAUD)) - 1UL)
#if 100 * (F_CPU) > 16 * (UBRR_VALUE + 1) * (100 + BAUD_TOL) * (BAUD) || \
    100 * (F_CPU) < 16 * (UBRR_VALUE + 1) * (100 - BAUD_TOL) * (BAUD)
#undef UBRR_VALUE
#define UBRR_VALUE (((F_CPU) + 4UL * (BAUD)) / (8UL * (BAUD)) - 1UL)
#define USE_2X 1
#else
#define USE_2X 0
#endif
#define UBRRL_VALUE (UBRR_VALUE & 0xff)
#define UBRRH_VALUE (UBRR_VALUE >> 8)
