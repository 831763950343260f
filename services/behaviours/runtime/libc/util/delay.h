#ifndef KILOTWIN_UTIL_DELAY_H
#define KILOTWIN_UTIL_DELAY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
void _delay_ms(double ms);
void _delay_us(double us);
/* Delays of three and of four cycles per count. A count of 0 means 256 and 65536. */
void _delay_loop_1(uint8_t count);
void _delay_loop_2(uint16_t count);
#ifdef __cplusplus
}
#endif

#endif
